#pragma once
// Maps the clock of a device to ours by the fastest arrivals.
#include <algorithm>

#include "core/base/time.hpp"

namespace embody::teleop {

/// offset = min over time of (arrival - device time); it follows a slower device clock by at most `kDrift` per second,
/// so that one late packet does not move it. A device clock that jumps by more than `kJump` starts afresh.
class ClockMap {
 public:
  /// Device time `device` on our clock, given that its message arrived at `arrival`.
  TimePoint map(Duration device, TimePoint arrival) noexcept {
    const Duration offset = arrival.time_since_epoch() - device;
    const Duration elapsed = device - last_device_;
    if (!started_ || elapsed < Duration{0} || elapsed > kJump) {
      offset_ = offset;
      started_ = true;
    } else {
      const Duration allowance{static_cast<Duration::rep>(kDrift * static_cast<double>(elapsed.count()))};
      offset_ = std::min(offset, offset_ + allowance);
    }
    last_device_ = device;
    return TimePoint{device + offset_};
  }

 private:
  static constexpr double kDrift = 1e-4;
  static constexpr Duration kJump = std::chrono::seconds(1);
  bool started_{false};
  Duration offset_{0};
  Duration last_device_{0};
};

}  // namespace embody::teleop
