#pragma once
// Which frames a running measurement delivers, and when: time comes in as an argument.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/base/time.hpp"

namespace embody::sim {

/// Frame k is due at the start + k / rate. Faults lose, hold back or renumber frames. Ticks count the frames since the
/// start, also the lost ones.
class Playback {
 public:
  explicit Playback(double rate_hz) : rate_hz_(rate_hz) {}

  void start(TimePoint now) {
    t_start_ = now;
    tick_ = 0;
    epoch_ = 0;
  }
  [[nodiscard]] std::size_t tick() const noexcept { return tick_; }
  /// When the next frame is to be handled.
  [[nodiscard]] TimePoint t_next() const noexcept { return std::max(due(tick_), t_stalled_until_); }
  /// The next frame is lost, not delivered.
  [[nodiscard]] bool lost() const noexcept {
    if (due(tick_) < t_paused_until_) return true;
    if (skip_ > 0 && tick_ % skip_ == skip_ - 1) return true;
    if (delivered_hz_ <= 0.0 || delivered_hz_ >= rate_hz_) return false;
    const double ratio = delivered_hz_ / rate_hz_;
    const auto frame = static_cast<double>(tick_);
    return std::floor((frame + 1.0) * ratio) == std::floor(frame * ratio);
  }
  void advance() noexcept { ++tick_; }
  /// The next frame as counted on the wire, from 0 at the start or the last reset.
  [[nodiscard]] std::size_t number() const noexcept { return tick_ - epoch_; }
  /// Numbers and time stamps start again with the next frame.
  void reset_numbers() noexcept { epoch_ = tick_; }

  void stall_until(TimePoint t) noexcept { t_stalled_until_ = t; }
  void pause_until(TimePoint t) noexcept { t_paused_until_ = t; }
  void set_skip(std::size_t every) noexcept { skip_ = every; }
  void set_delivered_rate(double hz) noexcept { delivered_hz_ = hz; }

 private:
  [[nodiscard]] TimePoint due(std::size_t tick) const noexcept {
    return t_start_ + from_seconds(static_cast<double>(tick) / rate_hz_);
  }

  double rate_hz_;
  TimePoint t_start_{};
  TimePoint t_stalled_until_{};
  TimePoint t_paused_until_{};
  std::size_t tick_{0};
  std::size_t epoch_{0};  // tick that has time stamp 0
  std::size_t skip_{0};
  double delivered_hz_{0.0};
};

}  // namespace embody::sim
