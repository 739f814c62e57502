#pragma once
// Counts heap use of real-time threads after start. The malloc family itself is replaced (heap_guard.cpp), so that C
// libraries count too. Without effect under sanitizers, which replace malloc themselves.
#include <cstdint>

namespace embody::heap_guard {

/// From now on, each allocation or release of the calling thread counts.
void watch_this_thread() noexcept;
/// Allocations and releases of all watched threads so far.
[[nodiscard]] std::uint64_t count() noexcept;
/// False when the malloc family could not be replaced: count() is then meaningless.
[[nodiscard]] bool active() noexcept;

}  // namespace embody::heap_guard
