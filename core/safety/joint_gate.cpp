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

/// Greatest part s in [0, 1] of `way` with |from + s way| <= limit.
double part_within(const Eigen::Vector3d& from, const Eigen::Vector3d& way, double limit) noexcept {
  const double c = limit * limit - from.squaredNorm();
  const double a = way.squaredNorm();
  if (c <= 0.0) return 0.0;
  if (a < 1e-18) return 1.0;
  const double b = from.dot(way);
  return std::min(1.0, (std::sqrt(b * b + a * c) - b) / a);
}

}  // namespace

void JointGate::reset(const Vector6& q_rad) noexcept {
  q_rad_ = q_rad;
  qd_rad_s_.setZero();
}

void JointGate::follow(const Vector6& q_d_rad, const Vector6& qd_d_rad_s, double dt_s,
                       const FlangeLimit* flange) noexcept {
  move(wanted_speed(q_d_rad, qd_d_rad_s, dt_s), dt_s, flange);
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
  move(Vector6::Zero(), dt_s, nullptr);
}

void JointGate::move(const Vector6& wanted_rad_s, double dt_s, const FlangeLimit* flange) noexcept {
  const Vector6 step = limits_.acceleration_rad_s2 * dt_s;
  Vector6 qd = wanted_rad_s.cwiseMax(qd_rad_s_ - step).cwiseMin(qd_rad_s_ + step);
  if (flange != nullptr) qd = keep_flange_limit(qd, dt_s, *flange);
  for (int i = 0; i < 6; ++i) {  // the range has the last word; braking with the full deceleration always satisfies it
    const double a = limits_.acceleration_rad_s2[i];
    const double up = std::min(limits_.speed_rad_s[i], stoppable_speed(limits_.upper_rad[i] - q_rad_[i], a, dt_s));
    const double down = std::min(limits_.speed_rad_s[i], stoppable_speed(q_rad_[i] - limits_.lower_rad[i], a, dt_s));
    qd_rad_s_[i] += std::clamp(std::clamp(qd[i], -down, up) - qd_rad_s_[i], -step[i], step[i]);
    q_rad_[i] += qd_rad_s_[i] * dt_s;
  }
}

/// Between slowing down evenly (which the last tick's speed allows, as it kept the limit) and `qd_rad_s`, the point
/// nearest to `qd_rad_s` at which the flange keeps its limits. Both ends are within the accelerations, so is the point.
Vector6 JointGate::keep_flange_limit(const Vector6& qd_rad_s, double dt_s, const FlangeLimit& flange) const noexcept {
  double slower = 1.0;
  for (int i = 0; i < 6; ++i) {
    const double speed = std::abs(qd_rad_s_[i]);
    if (speed > 0.0) slower = std::min(slower, limits_.acceleration_rad_s2[i] * dt_s / speed);
  }
  const Vector6 slow = (1.0 - slower) * qd_rad_s_;
  const Vector6 from = flange.J * slow;
  const Vector6 way = flange.J * (qd_rad_s - slow);
  const double part = std::min(part_within(from.head<3>(), way.head<3>(), flange.speed_m_s),
                               part_within(from.tail<3>(), way.tail<3>(), flange.speed_rad_s));
  return slow + part * (qd_rad_s - slow);
}

}  // namespace embody::safety
