#pragma once
// Counts heap use of the calling thread, for tests that forbid it. Do not link it together with the daemon, whose heap
// guard replaces the malloc family as well.
#include <cstdint>

namespace embody::test {

/// Allocations of this thread so far: malloc, calloc, realloc, aligned_alloc, posix_memalign, and hence operator new
/// and Eigen. Stands still under sanitizers, which own malloc.
[[nodiscard]] std::uint64_t heap_allocations() noexcept;
/// False when nothing is counted.
[[nodiscard]] bool counts_heap() noexcept;

}  // namespace embody::test
