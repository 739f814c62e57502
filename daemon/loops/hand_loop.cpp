#include "daemon/loops/hand_loop.hpp"

#include <algorithm>

#include "drivers/transport/clock.hpp"

namespace embody {

using transport::now;

void HandLoop::run() noexcept {
  constexpr Duration kLongestWait =
      std::chrono::milliseconds(10);  // the driver's reply time-outs are checked in read()
  t_next_ = now();
  while (!edges_.stop.load(std::memory_order_relaxed)) {
    wait_for_input(baton_.fd(), -1, std::min<Duration>(t_next_ - now(), kLongestWait));
    edges_.heartbeats.hand.fetch_add(1, std::memory_order_relaxed);
    if (baton_.with_loop()) {
      if (baton_.take_revoked()) {
        lose_hand();
      } else {
        read();
      }
    }
    const TimePoint t = now();
    if (t < t_next_) continue;
    const auto late = (t - t_next_) / config_.period;  // overruns are counted and passed over, never caught up
    edges_.counters.hand_cycles_late.fetch_add(static_cast<std::uint64_t>(late), std::memory_order_relaxed);
    t_next_ += (late + 1) * config_.period;
    cycle(t);
  }
  stop_motors();
}

void HandLoop::read() noexcept {
  const IoStatus status = baton_.driver().read(report_.state);
  if (status == IoStatus::kDisconnected) return lose_hand();
  if (status != IoStatus::kDone) return;
  edges_.counters.hand_replies.fetch_add(1, std::memory_order_relaxed);
  edges_.hand_ready.store(true, std::memory_order_relaxed);
}

void HandLoop::cycle(TimePoint t) noexcept {
  edges_.mode_to_hand.update();
  edges_.target_to_hand.update();
  if (!baton_.with_loop()) return;
  HandCommand command =
      gate_.step(t, to_seconds(config_.period), edges_.mode_to_hand.get(), edges_.target_to_hand.get(), report_.state);
  command.sequence = ++sequence_;
  command.t_expires = t + config_.period;
  if (command.joint_count == 0) command.joint_count = baton_.info().joint_count;
  const IoStatus status = baton_.driver().write(command, now());
  if (status == IoStatus::kDisconnected) return lose_hand();
  if (status == IoStatus::kDone && command.action == HandAction::kMove) {
    edges_.counters.hand_commands.fetch_add(1, std::memory_order_relaxed);
  }
  report_.command = command;
  report_.hold = gate_.hold();
  report_.kept_joints = gate_.kept_joints();
  edges_.hand_to_telemetry.publish(report_);
}

/// A short, bounded farewell: the stop command and the time for its answer.
void HandLoop::stop_motors() noexcept {
  if (!baton_.with_loop()) return;
  HandCommand command;
  command.action = HandAction::kStop;
  command.joint_count = baton_.info().joint_count;
  command.t_expires = now() + std::chrono::seconds(1);
  const TimePoint t_end = now() + std::chrono::milliseconds(150);
  if (baton_.driver().write(command, now()) == IoStatus::kDisconnected) return;
  while (now() < t_end) {
    wait_for_input(baton_.fd(), -1, std::chrono::milliseconds(10));
    if (baton_.driver().read(report_.state) == IoStatus::kDisconnected) return;
  }
}

void HandLoop::lose_hand() noexcept {
  edges_.hand_ready.store(false, std::memory_order_relaxed);
  report_ = {};
  edges_.hand_to_telemetry.publish(report_);
  baton_.give_back();
}

}  // namespace embody
