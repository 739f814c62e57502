#include "daemon/loops/arm_loop.hpp"

#include <algorithm>

#include "drivers/transport/clock.hpp"

namespace embody {

using safety::Mode;
using transport::now;

void ArmLoop::run() noexcept {
  TimePoint t_stop{};
  bool still = false;
  while (!still) {
    wait_for_input(arm_.fd(), -1, 2 * period_);
    edges_.heartbeats.arm.fetch_add(1, std::memory_order_relaxed);
    read_packages();
    if (!edges_.stop.load(std::memory_order_relaxed)) continue;
    if (t_stop == TimePoint{}) t_stop = now();
    still = !arm_alive_ || (!commanding_ && machine_.state().mode == Mode::kStopped);
    if (now() - t_stop > kStopTime) break;
  }
  edges_.arm_still.store(still, std::memory_order_relaxed);
  edges_.arm_finished.store(true, std::memory_order_release);
}

/// Every package is answered by one command, in order, so that the sequence has no gap. A backlog after a stall of this
/// machine is worked off in bursts; the driver refuses answers to packages older than a command's lifetime.
void ArmLoop::read_packages() noexcept {
  constexpr int kBurst = 16;
  int packages = 0;
  if (arm_.with_loop()) {
    if (arm_.take_revoked()) return lose_arm();
    if (t_session_ == TimePoint{}) begin_session();
    for (; packages < kBurst; ++packages) {
      const IoStatus status = arm_.driver().read(report_.state);
      if (status == IoStatus::kDisconnected) return lose_arm();
      if (status != IoStatus::kDone) break;
      edges_.counters.robot_packages.fetch_add(1, std::memory_order_relaxed);
      arm_alive_ = true;
      tick(now());
    }
  }
  if (packages > 0) return;
  // Without a package a time-out is still a tick of the mode machine.
  const TimePoint t = now();
  if (t_session_ != TimePoint{} && t - std::max(t_session_, t_package_) > (arm_alive_ ? kSilence : kFirstPackage)) {
    return lose_arm();
  }
  take_pose();
  step_modes(t);
}

void ArmLoop::begin_session() noexcept {
  t_session_ = now();
  if (arm_.info().rate_hz > 0.0) period_ = from_seconds(1.0 / arm_.info().rate_hz);
}

/// Nothing of a session outlives it: a new one starts from what the robot then says.
void ArmLoop::lose_arm() noexcept {
  if (arm_.with_loop()) arm_.give_back();
  t_session_ = TimePoint{};
  arm_alive_ = false;
  commanding_ = false;
  tracked_ = false;
  engage_pending_ = false;
  reachable_ = false;
  controller_.halt();
  report_.state = {};
  edges_.arm_to_telemetry.publish(report_);
  last_controller_time_ = Duration{0};
  step_modes(now());
}

void ArmLoop::take_pose() noexcept {
  if (!edges_.pose_to_arm.update()) return;
  pose_is_new_ = true;
  const HandPose& pose = edges_.pose_to_arm.get();
  if (last_pose_ != 0) {
    edges_.counters.poses_superseded.fetch_add(pose.sequence - last_pose_ - 1, std::memory_order_relaxed);
  }
  last_pose_ = pose.sequence;
  streak_ = pose.streak;
  jumps_ = pose.jumps;
  if (!pose.valid) return;
  t_pose_ = pose.t_capture;
  controller_.add(pose.t_capture, pose.X_WM);
}

void ArmLoop::tick(TimePoint t_tick) noexcept {
  const ArmState& state = report_.state;
  const bool first = last_controller_time_ == Duration{0};
  const Duration elapsed = state.controller_time - last_controller_time_;
  // Set-points never move for longer than the robot's clock did; a clock that starts anew counts as one period.
  const Duration dt = first || elapsed <= Duration{0} ? period_ : std::min(elapsed, 10 * period_);
  if (!first && elapsed > period_) {
    const auto skipped = static_cast<std::uint64_t>((elapsed + period_ / 2) / period_ - 1);
    edges_.counters.robot_packages_skipped.fetch_add(skipped, std::memory_order_relaxed);
  }
  last_controller_time_ = state.controller_time;
  t_package_ = state.t_arrival;
  const TimePoint t_robot = robot_clock_.map(state.controller_time, state.t_arrival);
  t_expires_ = t_robot + config_.command_lifetime;

  take_pose();
  step_modes(t_tick);
  send(step_controller(t_robot, to_seconds(dt)), t_tick);
  edges_.arm_to_telemetry.publish(report_);
}

void ArmLoop::step_modes(TimePoint t) noexcept {
  safety::Health health;
  health.tracker_connected = tracker_.fd() >= 0;
  health.t_pose = t_pose_;
  health.fresh_streak = streak_;
  health.arm_connected = arm_alive_;
  health.arm = report_.state.condition;
  health.arm_following = arm_following(t);
  health.arm_at_rest = controller_.at_rest() && (commanding_ || robot_at_rest());
  health.hand_connected = edges_.hand_ready.load(std::memory_order_relaxed);
  health.hand_jumped = jumps_ != jumps_engaged_;
  health.target_reachable = reachable_;
  health.watchdog_bit = edges_.watchdog_bit.load(std::memory_order_relaxed);
  safety::Request request;
  const bool asked = edges_.requests.pop(request);
  const bool was_moving = is_moving_mode(machine_.state().mode);
  const Mode before = machine_.state().mode;
  report_.mode = machine_.step(t, asked ? &request : nullptr, health);
  if (report_.mode.mode == Mode::kEngaged && before != Mode::kEngaged) engage_pending_ = true;
  if (!is_moving_mode(report_.mode.mode)) jumps_engaged_ = jumps_;
  if (is_moving_mode(report_.mode.mode) && !was_moving) tracked_ = false;
  edges_.mode_to_hand.publish(report_.mode);
  edges_.mode_to_main.publish(report_.mode);
  edges_.mode_to_telemetry.publish(report_.mode);
}

bool ArmLoop::robot_at_rest() const noexcept {
  constexpr double kStill_rad_s = 0.02;
  return report_.state.qd_rad_s.cwiseAbs().maxCoeff() < kStill_rad_s;
}

/// Whether the robot's program does what it should: it gets a grace to start tracking, but must not leave off.
bool ArmLoop::arm_following(TimePoint t) const noexcept {
  if (!is_moving_mode(machine_.state().mode) || report_.state.tracking) return true;
  return !tracked_ && t - machine_.state().t_since < config_.arming_grace;
}

teleop::ArmReference ArmLoop::step_controller(TimePoint t_robot, double dt_s) noexcept {
  const ArmState& state = report_.state;
  const bool moving = is_moving_mode(report_.mode.mode);
  if (moving && state.tracking) tracked_ = true;
  commanding_ = state.condition == ArmCondition::kReady && (moving || !controller_.at_rest());
  if (!commanding_) {
    reachable_ = controller_.track_measured(t_robot, state.q_target_rad);
    return {Pose::Identity(), state.q_target_rad, Vector6::Zero(), reachable_};
  }
  if (report_.mode.mode != Mode::kEngaged || !tracked_) return controller_.brake(dt_s);
  if (engage_pending_) {
    controller_.engage(t_robot);
    engage_pending_ = false;
  }
  teleop::ArmReference reference = controller_.follow(t_robot, dt_s);
  reachable_ = reference.reachable;
  return reference;
}

void ArmLoop::send(const teleop::ArmReference& reference, TimePoint t_tick) noexcept {
  ArmCommand& command = report_.command;
  command.sequence = ++sequence_;
  command.action = commanding_ ? ArmAction::kTrack : ArmAction::kHold;
  command.q_rad = reference.q_rad;
  command.qd_rad_s = reference.qd_rad_s;
  command.t_capture = t_pose_;
  command.t_expires = t_expires_;
  report_.X_BEd = reference.X_BEd;
  const TimePoint t_computed = now();
  const IoStatus status = arm_.driver().write(command, t_computed);
  const TimePoint t_written = now();
  if (status == IoStatus::kDone) {
    edges_.counters.arm_commands.fetch_add(1, std::memory_order_relaxed);
  } else {
    edges_.counters.arm_commands_dropped.fetch_add(1, std::memory_order_relaxed);
    --sequence_;  // the robot sees consecutive numbers
  }
  if (!pose_is_new_ || status != IoStatus::kDone) return;
  pose_is_new_ = false;
  const HandPose& pose = edges_.pose_to_arm.get();
  edges_.arm_timings.push({pose.t_arrival, pose.t_decoded, pose.t_estimated, t_tick, t_computed, t_written});
}

}  // namespace embody
