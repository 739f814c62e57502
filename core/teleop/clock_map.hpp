#pragma once
// Maps the clock of a device to ours by the fastest arrivals.
#include <algorithm>
#include <array>
#include <cstddef>

#include "core/base/time.hpp"

namespace embody::teleop {

/// A minimum filter that follows the drift of the device's clock, up to 200 ppm. The offset (arrival - device time) of
/// the fastest message is taken at once; between fast messages it is extrapolated with the drift that the minima of the
/// last half minute show, plus a margin that lets it recover. So one late message moves nothing, and the error is that
/// of the fastest messages. Results are never later than the arrival and, for arrivals in order, never go back. A
/// device clock that goes back, or ahead by more than a second, starts afresh. About 10 ns, no heap.
class ClockMap {
 public:
  /// Device time `device` on our clock, given that its message arrived at `arrival`. Late by the shortest latency.
  TimePoint map(Duration device, TimePoint arrival) noexcept {
    const Duration offset = arrival.time_since_epoch() - device;
    const Duration elapsed = device - t_device_;
    if (!started_ || elapsed < Duration{0} || elapsed > kJump) {
      restart(device, offset);
    } else {
      offset_ = std::min(offset, offset_ + scaled(rate_ + margin(), elapsed));
      note(device, offset);
    }
    t_device_ = device;
    t_mapped_ = std::min(std::max(TimePoint{device + offset_}, t_mapped_), arrival);
    return t_mapped_;
  }

  /// Drift found so far: how much faster our clock runs, as a fraction (1e-4 = 100 ppm). 0 until it is known.
  [[nodiscard]] double drift() const noexcept { return rate_; }

 private:
  static constexpr double kMostDrift = 2e-4;
  static constexpr double kMargin = 2e-5;  // above the error of the drift found from minima that differ by 0.2 ms
  static constexpr Duration kJump = std::chrono::seconds(1);
  static constexpr Duration kWindow = std::chrono::seconds(1);
  static constexpr std::size_t kWindows = 32;
  static constexpr std::size_t kEnough = 8;

  struct Minimum {
    Duration device{0};
    Duration offset{0};
  };

  static Duration scaled(double factor, Duration duration) noexcept {
    return Duration{static_cast<Duration::rep>(factor * static_cast<double>(duration.count()))};
  }
  [[nodiscard]] double margin() const noexcept { return known_ ? kMargin : kMostDrift; }

  void restart(Duration device, Duration offset) noexcept {
    started_ = true;
    offset_ = offset;
    count_ = 0;
    window_start_ = device;
    window_ = {device, offset};
  }

  /// Keeps the fastest message of each window; a full window corrects the drift.
  void note(Duration device, Duration offset) noexcept {
    if (offset - scaled(rate_, device - window_.device) < window_.offset) window_ = {device, offset};
    if (device - window_start_ < kWindow) return;
    minima_[count_ % kWindows] = window_;
    ++count_;
    if (count_ >= kEnough) find_drift();
    window_start_ = device;
    window_ = {device, offset};
  }

  /// Slope between the fastest message of the older and of the newer half of the windows, both judged along the drift
  /// known so far.
  void find_drift() noexcept {
    const std::size_t kept = std::min(count_, kWindows);
    const auto at = [&](std::size_t i) -> const Minimum& { return minima_[(count_ - kept + i) % kWindows]; };
    const auto fastest = [&](std::size_t first, std::size_t last) {
      Minimum least = at(first);
      for (std::size_t i = first + 1; i < last; ++i) {
        if (at(i).offset - scaled(rate_, at(i).device - least.device) < least.offset) least = at(i);
      }
      return least;
    };
    const Minimum older = fastest(0, kept / 2);
    const Minimum newer = fastest(kept / 2, kept);
    const auto span = static_cast<double>((newer.device - older.device).count());
    if (span <= 0.0) return;
    rate_ = std::clamp(static_cast<double>((newer.offset - older.offset).count()) / span, -kMostDrift, kMostDrift);
    known_ = known_ || count_ >= kWindows;
  }

  bool started_{false};
  bool known_{false};  // the drift
  double rate_{0.0};
  Duration offset_{0};
  Duration t_device_{0};
  TimePoint t_mapped_{};
  Duration window_start_{0};
  Minimum window_;
  std::array<Minimum, kWindows> minima_{};
  std::size_t count_{0};  // windows filled since the start
};

}  // namespace embody::teleop
