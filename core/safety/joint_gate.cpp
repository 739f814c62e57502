#include "core/safety/joint_gate.hpp"

#include <algorithm>
#include <cmath>

namespace embody::safety {
namespace {

/// Greatest speed v at which a joint may move for one tick and then still stop within `distance` by decelerating with
/// `a`: v dt + v^2 / (2 a) = distance. Decelerating with `a` from a speed that satisfied this one tick ago satisfies it
/// again, whatever the length of the ticks.
double stoppable_speed(double distance, double a, double dt_s) noexcept {
  if (!(distance > 0.0)) return 0.0;
  return a * (std::sqrt(dt_s * dt_s + 2.0 * distance / a) - dt_s);
}

}  // namespace

void JointGate::reset(const Vector6& q_rad) noexcept {
  q_rad_ = q_rad;
  qd_rad_s_.setZero();
}

void JointGate::follow(const Vector6& q_d_rad, const Vector6& qd_d_rad_s, double dt_s) noexcept {
  move(wanted_speed(q_d_rad, qd_d_rad_s, dt_s), dt_s);
}

Vector6 JointGate::wanted_speed(const Vector6& q_d_rad, const Vector6& qd_d_rad_s, double dt_s) const noexcept {
  Vector6 wanted = Vector6::Zero();
  if (!q_d_rad.allFinite() || !qd_d_rad_s.allFinite()) return wanted;
  for (int i = 0; i < 6; ++i) {
    const double a = limits_.acceleration_rad_s2[i];
    const double target = std::clamp(q_d_rad[i], limits_.lower_rad[i], limits_.upper_rad[i]);
    const double d = target - q_rad_[i];
    const double closing =
        std::min({std::sqrt(a * std::abs(d)), kGain * std::abs(d), stoppable_speed(std::abs(d), a, dt_s)});
    const double feed_forward = target == q_d_rad[i] ? qd_d_rad_s[i] : 0.0;
    wanted[i] = std::copysign(closing, d) + feed_forward;
  }
  return wanted;
}

void JointGate::brake(double dt_s) noexcept {
  move(Vector6::Zero(), dt_s);
}

void JointGate::move(const Vector6& wanted_rad_s, double dt_s) noexcept {
  for (int i = 0; i < 6; ++i) {
    const double a = limits_.acceleration_rad_s2[i];
    const double up = std::min(limits_.speed_rad_s[i], stoppable_speed(limits_.upper_rad[i] - q_rad_[i], a, dt_s));
    const double down = std::min(limits_.speed_rad_s[i], stoppable_speed(q_rad_[i] - limits_.lower_rad[i], a, dt_s));
    double& qd = qd_rad_s_[i];
    qd += std::clamp(std::clamp(wanted_rad_s[i], -down, up) - qd, -a * dt_s, a * dt_s);
    q_rad_[i] += qd * dt_s;
  }
}

}  // namespace embody::safety
