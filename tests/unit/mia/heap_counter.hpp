#pragma once
// Counts heap allocations of the calling thread, for tests that forbid them.
#include <cstdint>

namespace embody::test {

/// Allocations of this thread so far. Always 0 under sanitizers, which own malloc.
[[nodiscard]] std::uint64_t heap_allocations() noexcept;
/// False when nothing is counted.
[[nodiscard]] bool counts_heap() noexcept;

}  // namespace embody::test
