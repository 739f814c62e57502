#include "daemon/loops/tracker_loop.hpp"

#include "drivers/transport/clock.hpp"

namespace embody {

using transport::now;

void TrackerLoop::run() noexcept {
  while (!edges_.stop.load(std::memory_order_relaxed)) {
    wait_for_input(baton_.fd(), -1, std::chrono::milliseconds(20));
    edges_.heartbeats.tracker.fetch_add(1, std::memory_order_relaxed);
    if (!baton_.with_loop()) continue;
    if (baton_.take_revoked()) {
      baton_.give_back();
      continue;
    }
    drain();
  }
}

/// Every buffered frame is used; the newest one is published.
void TrackerLoop::drain() noexcept {
  constexpr int kBurst = 64;  // bounds the time until the next heartbeat
  bool any = false;
  for (int i = 0; i < kBurst; ++i) {
    const IoStatus status = baton_.driver().read(tracked_.frame);
    if (status == IoStatus::kDisconnected) {
      baton_.give_back();
      break;
    }
    if (status != IoStatus::kDone) break;
    use();
    any = true;
  }
  if (!any) return;
  edges_.palm_scale.store(estimator_.palm_scale(), std::memory_order_relaxed);
  edges_.pose_to_arm.publish(ahead_);
  edges_.frame_to_fingers.publish(tracked_);
  edges_.fingers_wake.notify();
  edges_.pose_to_telemetry.publish(tracked_.pose);
}

void TrackerLoop::use() noexcept {
  const TimePoint t_decoded = now();
  if (label_epoch_ && *label_epoch_ != tracked_.frame.label_epoch) monitor_.restart();
  label_epoch_ = tracked_.frame.label_epoch;
  tracked_.pose = estimator_.step(tracked_.frame);
  if (const hand::TriadCheck* triad = estimator_.triad(); triad != nullptr) {
    tracked_.back = {true, triad->ambiguous(), triad->state(), triad->source(), triad->reference_m()};
  }
  monitor_.step(tracked_.pose);
  tracked_.pose.sequence = ++sequence_;
  tracked_.pose.t_decoded = t_decoded;
  ahead_ = tracked_.pose;
  predictor_.step(ahead_);
  tracked_.pose.t_estimated = ahead_.t_estimated = now();
  tracked_.sequence = sequence_;
  edges_.counters.frames_received.fetch_add(1, std::memory_order_relaxed);
  if (tracked_.pose.valid) {
    edges_.counters.frames_used.fetch_add(1, std::memory_order_relaxed);
  } else {
    edges_.counters.poses_invalid.fetch_add(1, std::memory_order_relaxed);
  }
}

}  // namespace embody
