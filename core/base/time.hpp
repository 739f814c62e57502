#pragma once
// Time points and durations. Core never reads a clock: time is an argument.
#include <chrono>

namespace embody {

using Duration = std::chrono::nanoseconds;
/// A point on CLOCK_MONOTONIC. The default value (epoch) means "never".
using TimePoint = std::chrono::time_point<std::chrono::steady_clock, Duration>;

[[nodiscard]] constexpr double to_seconds(Duration d) noexcept {
  return std::chrono::duration<double>(d).count();
}
/// @pre |seconds| < 9e9
[[nodiscard]] constexpr Duration from_seconds(double seconds) noexcept {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

}  // namespace embody
