#include "core/safety/hand_gate.hpp"

#include <algorithm>
#include <cmath>

namespace embody::safety {
namespace {

bool all_finite(const HandDeviceState& state) noexcept {
  return std::all_of(state.q_rad.begin(), state.q_rad.begin() + static_cast<std::ptrdiff_t>(state.joint_count),
                     [](double q_rad) { return std::isfinite(q_rad); });
}

}  // namespace

const char* to_string(HandHold hold) noexcept {
  switch (hold) {
    case HandHold::kNone:
      return "";
    case HandHold::kModeStale:
      return "the arm loop is late";
    case HandHold::kMode:
      return "not engaged";
    case HandHold::kNoAnswer:
      return "the robot hand does not tell where it is";
    case HandHold::kNotSeen:
      return "the pose of the human hand is not known";
    case HandHold::kTargetStale:
      return "the finger angles are too old";
    case HandHold::kUnsure:
      return "confidence in the back of the human hand is below safety.min_hand_confidence";
  }
  return "unknown";
}

/// First reason why the hand must not move now, kNone if there is none.
HandHold HandGate::obstacle(TimePoint now, const ModeState& mode, const FingerTarget& target,
                            const HandDeviceState& measured) const noexcept {
  if (now - mode.t > config_.mode_timeout) return HandHold::kModeStale;
  if (mode.mode != Mode::kEngaged) return HandHold::kMode;
  if (measured.reply == 0 || now - measured.t_arrival > config_.measured_timeout) return HandHold::kNoAnswer;
  if (!all_finite(measured)) return HandHold::kNoAnswer;
  if (!target.valid || target.joint_count != measured.joint_count) return HandHold::kNotSeen;
  if (now - target.t_capture > config_.target_timeout) return HandHold::kTargetStale;
  if (!sure(target.hand_confidence)) return HandHold::kUnsure;
  return HandHold::kNone;
}

HandCommand HandGate::step(TimePoint now, double dt_s, const ModeState& mode, const FingerTarget& target,
                           const HandDeviceState& measured) noexcept {
  HandCommand command;
  command.joint_count = measured.joint_count;
  kept_joints_ = 0;
  hold_ = obstacle(now, mode, target, measured);
  if (stopped_ && hold_ == HandHold::kNone) hold_ = HandHold::kMode;
  stopped_ = false;
  if (hold_ != HandHold::kNone) {
    following_ = false;
    stopped_ = hold_ == HandHold::kMode && mode.mode == Mode::kStopped;
    command.action = stopped_ ? HandAction::kStop : HandAction::kHold;
    return command;
  }
  if (!following_) goal_rad_ = q_rad_ = measured.q_rad;
  following_ = true;
  const double step = config_.speed_rad_s * dt_s;
  for (std::size_t i = 0; i < measured.joint_count; ++i) {
    if (!sure(target.joint_confidence[i])) {
      kept_joints_ |= std::uint32_t{1} << i;
    } else if (std::isfinite(target.q_rad[i])) {
      goal_rad_[i] = target.q_rad[i];
    }
    q_rad_[i] += std::clamp(goal_rad_[i] - q_rad_[i], -step, step);
    q_rad_[i] = std::clamp(q_rad_[i], measured.q_rad[i] - config_.lead_rad, measured.q_rad[i] + config_.lead_rad);
  }
  command.action = HandAction::kMove;
  command.q_rad = q_rad_;
  command.t_capture = target.t_capture;
  return command;
}

}  // namespace embody::safety
