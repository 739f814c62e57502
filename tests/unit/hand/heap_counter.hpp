#pragma once
// Counts heap allocations of the calling thread, for tests that forbid them.
#include <cstdint>

namespace embody::test {

/// Allocations of this thread so far (malloc family, hence operator new). Always 0 under sanitizers, which own malloc.
[[nodiscard]] std::uint64_t heap_allocations() noexcept;

}  // namespace embody::test
