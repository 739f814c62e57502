#include "daemon/loops/finger_loop.hpp"

#include <algorithm>
#include <cstdlib>
#include <ctime>

#include "drivers/transport/clock.hpp"

namespace embody {

using transport::now;

void FingerLoop::run() noexcept {
  while (!edges_.stop.load(std::memory_order_relaxed)) {
    if (wait_for_input(edges_.fingers_wake.fd(), -1, std::chrono::milliseconds(20))) edges_.fingers_wake.clear();
    edges_.heartbeats.fingers.fetch_add(1, std::memory_order_relaxed);
    if (duty_exceeded(now()) || !edges_.frame_to_fingers.update()) continue;
    use(edges_.frame_to_fingers.get());
  }
}

void FingerLoop::use(const TrackedFrame& tracked) noexcept {
  const TimePoint t_start = now();
  estimator_.step(tracked.frame, tracked.pose, report_.state);
  filter_.step(report_.state);
  report_.state.t_estimated = now();
  mapping_.step(report_.state, report_.target);
  report_.target.hand_confidence = estimator_.back_confidence(tracked.pose);
  slow_down(t_start);
  const TimePoint t_solved = now();
  report_.target.t_solved = t_solved;
  edges_.target_to_hand.publish(report_.target);
  for (std::size_t i = 0; i < kFingers; ++i) {
    edges_.filter_lag_ns[i].store(filter_.lag()[i].count(), std::memory_order_relaxed);
  }
  report_.tracked = tracked;
  report_.markers = estimator_.markers();
  report_.tally.add(tracked, report_.markers);
  edges_.fingers_to_telemetry.publish(report_);
  edges_.finger_timings.push(
      {tracked.pose.t_arrival, t_start, t_solved, report_.state.residual_m, report_.state.visible_markers});
  if (last_sequence_ != 0) {
    edges_.counters.finger_skipped.fetch_add(tracked.sequence - last_sequence_ - 1, std::memory_order_relaxed);
  }
  last_sequence_ = tracked.sequence;
  edges_.counters.finger_frames.fetch_add(1, std::memory_order_relaxed);
  busy_ += t_solved - t_start;
}

void FingerLoop::slow_down(TimePoint t_start) const noexcept {
  const Duration::rep setting = slow_down_ns_.load(std::memory_order_relaxed);
  if (setting == 0) return;
  const TimePoint t_end = t_start + Duration{std::abs(setting)};
  if (setting < 0) {
    while (now() < t_end) {
    }
    return;
  }
  const auto ns = t_end.time_since_epoch().count();
  const timespec until{static_cast<time_t>(ns / 1'000'000'000), static_cast<long>(ns % 1'000'000'000)};
  ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
}

/// At most half of each window is computed: a real-time thread must leave time to the rest of the machine. Frames that
/// arrive in the other half wait (the newest one) or are skipped.
bool FingerLoop::duty_exceeded(TimePoint t) noexcept {
  if (t - t_window_ >= kDutyWindow) {
    // A frame that took longer than half a window is paid for in the next ones.
    const auto windows = std::min<Duration::rep>((t - t_window_) / kDutyWindow, 100);
    busy_ = std::max(Duration{0}, busy_ - windows * (kDutyWindow / 2));
    t_window_ = t;
  }
  return busy_ > kDutyWindow / 2;
}

}  // namespace embody
