#include "core/safety/joint_gate.hpp"

#include <algorithm>
#include <cmath>

namespace embody::safety {

void JointGate::reset(const Vector6& q_rad) noexcept {
  q_rad_ = q_rad;
  qd_rad_s_.setZero();
}

void JointGate::follow(const Vector6& q_d_rad, const Vector6& qd_d_rad_s, double dt_s) noexcept {
  if (!q_d_rad.allFinite() || !qd_d_rad_s.allFinite()) return brake(dt_s);
  for (int i = 0; i < 6; ++i) {
    const double target = std::clamp(q_d_rad[i], limits_.lower_rad[i], limits_.upper_rad[i]);
    const double distance = target - q_rad_[i];
    const double closing =
        std::min(std::sqrt(limits_.acceleration_rad_s2[i] * std::abs(distance)), kGain * std::abs(distance));
    const double feed_forward = target == q_d_rad[i] ? qd_d_rad_s[i] : 0.0;
    move_with(i, std::copysign(closing, distance) + feed_forward, dt_s);
  }
}

void JointGate::brake(double dt_s) noexcept {
  for (int i = 0; i < 6; ++i) move_with(i, 0.0, dt_s);
}

void JointGate::move_with(int joint, double wanted_rad_s, double dt_s) noexcept {
  const double speed = limits_.speed_rad_s[joint];
  const double step = limits_.acceleration_rad_s2[joint] * dt_s;
  double& qd = qd_rad_s_[joint];
  qd += std::clamp(std::clamp(wanted_rad_s, -speed, speed) - qd, -step, step);
  q_rad_[joint] += qd * dt_s;
}

}  // namespace embody::safety
