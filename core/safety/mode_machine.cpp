#include "core/safety/mode_machine.hpp"

#include <array>

namespace embody::safety {
namespace {

/// Cause of a condition under which the arm must not be commanded; kNone when it is ready.
Cause arm_obstacle(const Health& health) noexcept {
  if (!health.arm_connected) return Cause::kArmLost;
  switch (health.arm) {
    case ArmCondition::kReady:
      return Cause::kNone;
    case ArmCondition::kProgramStopped:
      return Cause::kArmProgramStopped;
    case ArmCondition::kProtectiveStop:
      return Cause::kProtectiveStop;
    case ArmCondition::kEmergencyStop:
      return Cause::kEmergencyStop;
    case ArmCondition::kFault:
      return Cause::kArmFault;
    case ArmCondition::kUnknown:
    case ArmCondition::kNotRunning:
      return Cause::kArmNotReady;
  }
  return Cause::kArmFault;
}

/// Conditions that stop in any mode, and that a reset cannot leave while they last.
bool is_latching(Cause cause) noexcept {
  return cause == Cause::kProtectiveStop || cause == Cause::kEmergencyStop || cause == Cause::kArmFault;
}

bool is_latched(Mode mode) noexcept {
  return mode == Mode::kHolding || mode == Mode::kStopped;
}

}  // namespace

const char* to_string(Mode mode) noexcept {
  static constexpr std::array<const char*, 7> kNames{"offline",  "idle",    "aligned", "engaged",
                                                     "coasting", "holding", "stopped"};
  return kNames[static_cast<std::size_t>(mode)];
}

const char* to_string(Cause cause) noexcept {
  static constexpr std::array<const char*, 17> kNames{
      "",
      "asked by the operator",
      "no fresh hand pose",
      "hand tracker not connected",
      "target outside of the workspace or the arm's reach",
      "robot arm not connected",
      "robot arm not powered or brakes closed",
      "control program on the robot not running",
      "robot does not follow the commands",
      "protective stop of the robot",
      "emergency stop of the robot",
      "safety fault of the robot",
      "robot hand not connected",
      "sudden jump of the hand pose",
      "watchdog found a hung loop",
      "shutting down",
      "decided too late",
  };
  return kNames[static_cast<std::size_t>(cause)];
}

const ModeState& ModeMachine::step(TimePoint now, const Request* request, const Health& health) noexcept {
  if (state_.t == TimePoint{}) state_.t_since = now;
  state_.t = now;
  if (health.target_reachable || !is_moving_mode(state_.mode)) t_reachable_ = now;
  const std::uint32_t epoch = state_.epoch;
  check_faults(now, health);
  if (state_.epoch == epoch) check_input(now, health);
  if (state_.epoch == epoch) check_readiness(now, health);
  if (request != nullptr) {
    state_.request_id = request->id;
    state_.refusal = Cause::kNone;
    state_.request_accepted = decide(now, *request, health);
  }
  return state_;
}

void ModeMachine::enter(Mode mode, Cause cause, TimePoint now) noexcept {
  if (mode == state_.mode) {
    state_.cause = cause;
    return;
  }
  const bool motion_ends =
      is_moving_mode(state_.mode) && is_latched(mode) && cause != Cause::kOperator && cause != Cause::kShutdown;
  if (motion_ends) ++state_.holds;
  state_.mode = mode;
  state_.cause = cause;
  state_.t_since = now;
  ++state_.epoch;
}

/// Faults of devices and loops: they end motion for good.
void ModeMachine::check_faults(TimePoint now, const Health& health) noexcept {
  if (state_.mode == Mode::kStopped) return;
  const bool active = is_moving_mode(state_.mode) || state_.mode == Mode::kHolding;
  const Cause arm = arm_obstacle(health);
  if (health.watchdog_bit) return enter(Mode::kStopped, Cause::kWatchdog, now);
  if (arm != Cause::kNone && (active || is_latching(arm))) return enter(Mode::kStopped, arm, now);
  if (active && !health.hand_connected) return enter(Mode::kStopped, Cause::kHandLost, now);
  if (!is_moving_mode(state_.mode)) return;
  if (!health.arm_following) return enter(Mode::kHolding, Cause::kArmNotFollowing, now);
  if (health.hand_jumped) enter(Mode::kHolding, Cause::kHandPoseJumped, now);
}

/// Late or unusable input: brake, go on if it comes back at once, otherwise hold, and stop when it stays away.
void ModeMachine::check_input(TimePoint now, const Health& health) noexcept {
  const Duration age = now - health.t_pose;
  switch (state_.mode) {
    case Mode::kEngaged:
      if (age > config_.hold_after) return enter(Mode::kCoasting, Cause::kTrackerStale, now);
      if (now - t_reachable_ > config_.unreachable_grace) return enter(Mode::kHolding, Cause::kTargetUnreachable, now);
      return;
    case Mode::kCoasting:
      if (health.arm_at_rest || now - state_.t_since > config_.resume_within) {
        return enter(Mode::kHolding, Cause::kTrackerStale, now);
      }
      if (age <= config_.hold_after && health.fresh_streak >= config_.resume_frames) {
        return enter(Mode::kEngaged, Cause::kNone, now);
      }
      return;
    case Mode::kHolding:
      if (age > config_.stop_after) return enter(Mode::kStopped, Cause::kTrackerLost, now);
      return;
    default:
      return;
  }
}

/// Offline, idle and aligned follow the devices.
void ModeMachine::check_readiness(TimePoint now, const Health& health) noexcept {
  if (is_moving_mode(state_.mode) || is_latched(state_.mode)) return;
  if (!health.tracker_connected) return enter(Mode::kOffline, Cause::kTrackerLost, now);
  if (!health.arm_connected) return enter(Mode::kOffline, Cause::kArmLost, now);
  if (!health.hand_connected) return enter(Mode::kOffline, Cause::kHandLost, now);
  const Cause cause = obstacle(now, health);
  enter(cause == Cause::kNone ? Mode::kAligned : Mode::kIdle, cause, now);
}

bool ModeMachine::fresh(TimePoint now, const Health& health) const noexcept {
  return now - health.t_pose <= config_.hold_after && health.fresh_streak >= config_.resume_frames;
}

Cause ModeMachine::obstacle(TimePoint now, const Health& health) const noexcept {
  if (!health.tracker_connected) return Cause::kTrackerLost;
  if (const Cause arm = arm_obstacle(health); arm != Cause::kNone) return arm;
  if (!health.hand_connected) return Cause::kHandLost;
  if (!fresh(now, health)) return Cause::kTrackerStale;
  if (!health.target_reachable) return Cause::kTargetUnreachable;
  if (!health.arm_at_rest) return Cause::kArmNotReady;
  return Cause::kNone;
}

bool ModeMachine::decide(TimePoint now, const Request& request, const Health& health) noexcept {
  const bool expired = request.t_expires != TimePoint{} && now > request.t_expires;
  switch (request.kind) {
    case RequestKind::kEngage:
      if (expired) return refuse(Cause::kRequestExpired);
      if (state_.mode == Mode::kEngaged) return true;
      if (state_.mode != Mode::kAligned && state_.mode != Mode::kHolding) return refuse(state_.cause);
      if (const Cause cause = obstacle(now, health); cause != Cause::kNone) return refuse(cause);
      enter(Mode::kEngaged, Cause::kNone, now);
      return true;
    case RequestKind::kDisengage:
      if (state_.mode == Mode::kStopped) return refuse(state_.cause);
      if (is_moving_mode(state_.mode) || state_.mode == Mode::kHolding) enter(Mode::kIdle, Cause::kOperator, now);
      return true;
    case RequestKind::kStop:
      if (!shutting_down()) enter(Mode::kStopped, Cause::kOperator, now);
      return true;
    case RequestKind::kShutdown:
      enter(Mode::kStopped, Cause::kShutdown, now);
      return true;
    case RequestKind::kReset:
      if (expired) return refuse(Cause::kRequestExpired);
      if (state_.mode != Mode::kStopped) return true;
      if (shutting_down()) return refuse(Cause::kShutdown);
      if (health.watchdog_bit) return refuse(Cause::kWatchdog);
      if (const Cause cause = arm_obstacle(health); health.arm_connected && is_latching(cause)) return refuse(cause);
      enter(Mode::kIdle, Cause::kOperator, now);
      return true;
  }
  return false;
}

bool ModeMachine::refuse(Cause cause) noexcept {
  state_.refusal = cause;
  return false;
}

bool ModeMachine::shutting_down() const noexcept {
  return state_.mode == Mode::kStopped && state_.cause == Cause::kShutdown;
}

}  // namespace embody::safety
