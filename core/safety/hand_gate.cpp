#include "core/safety/hand_gate.hpp"

#include <algorithm>
#include <cmath>

namespace embody::safety {

HandCommand HandGate::step(TimePoint now, double dt_s, const ModeState& mode, const FingerTarget& target,
                           const HandDeviceState& measured) noexcept {
  HandCommand command;
  command.joint_count = measured.joint_count;
  const bool mode_current = now - mode.t <= config_.mode_timeout;
  const bool target_current = target.valid && target.joint_count == measured.joint_count && measured.reply > 0 &&
                              now - target.t_capture <= config_.target_timeout;
  if (!mode_current || mode.mode != Mode::kEngaged || !target_current) {
    following_ = false;
    command.action = mode_current && mode.mode == Mode::kStopped ? HandAction::kStop : HandAction::kHold;
    return command;
  }
  if (!following_) {
    for (std::size_t i = 0; i < measured.joint_count; ++i) {
      if (!std::isfinite(measured.q_rad[i])) return command;  // nowhere to start from: hold
    }
    q_rad_ = measured.q_rad;
  }
  following_ = true;
  const double step = config_.speed_rad_s * dt_s;
  for (std::size_t i = 0; i < measured.joint_count; ++i) {
    if (!std::isfinite(target.q_rad[i])) continue;
    q_rad_[i] += std::clamp(target.q_rad[i] - q_rad_[i], -step, step);
  }
  command.action = HandAction::kMove;
  command.q_rad = q_rad_;
  command.t_capture = target.t_capture;
  return command;
}

}  // namespace embody::safety
