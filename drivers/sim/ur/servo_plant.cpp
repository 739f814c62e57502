#include "drivers/sim/ur/servo_plant.hpp"

#include <algorithm>
#include <cmath>

namespace embody::sim {

Duration servo_lag(double lookahead_s, double gain) noexcept {
  return from_seconds(0.9 * std::clamp(lookahead_s, 0.03, 0.2) + 6.0 / std::clamp(gain, 100.0, 2000.0));
}

// With e = q - u and a = qd + w e the response is e(t) = (e + a t) exp(-w t), qd(t) = (qd - w a t) exp(-w t).
// On a ramp of speed v the steady lag is 2 v / w.
void ServoPlant::follow(const Vector6& q_set_rad, Duration lag, Duration dt) noexcept {
  braking_ = false;
  const double t = to_seconds(dt);
  const double w = 2.0 / std::max(to_seconds(lag), 1e-3);
  const double decay = std::exp(-w * t);
  for (int i = 0; i < 6; ++i) {
    const double error = q_rad_[i] - q_set_rad[i];
    const double a = qd_rad_s_[i] + w * error;
    const double limit = config_.max_speed_rad_s[i];
    const double next = q_set_rad[i] + (error + a * t) * decay;
    qd_rad_s_[i] = std::clamp((qd_rad_s_[i] - w * a * t) * decay, -limit, limit);
    q_rad_[i] = std::clamp(next, q_rad_[i] - limit * t, q_rad_[i] + limit * t);
  }
}

void ServoPlant::brake(Duration dt) noexcept {
  if (!braking_) deceleration_rad_s2_ = qd_rad_s_.cwiseAbs() / std::max(to_seconds(config_.stop_time), 1e-3);
  braking_ = true;
  slow_down(deceleration_rad_s2_, dt);
}

void ServoPlant::decelerate(double deceleration_rad_s2, Duration dt) noexcept {
  braking_ = false;
  slow_down(Vector6::Constant(deceleration_rad_s2), dt);
}

void ServoPlant::slow_down(const Vector6& deceleration_rad_s2, Duration dt) noexcept {
  const double t = to_seconds(dt);
  for (int i = 0; i < 6; ++i) {
    const double before = qd_rad_s_[i];
    const double speed = std::max(0.0, std::abs(before) - deceleration_rad_s2[i] * t);
    qd_rad_s_[i] = std::copysign(speed, before);
    q_rad_[i] += 0.5 * (before + qd_rad_s_[i]) * t;
  }
}

}  // namespace embody::sim
