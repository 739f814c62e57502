#pragma once
// The last word on arm joint motion: speed and acceleration of every joint stay inside their limits, whatever is asked.
#include "core/hal/types.hpp"

namespace embody::safety {

struct JointLimits {
  Vector6 speed_rad_s{Vector6::Constant(1.0)};
  Vector6 acceleration_rad_s2{Vector6::Constant(4.0)};
  Vector6 lower_rad{Vector6::Constant(-6.28318530717958648)};
  Vector6 upper_rad{Vector6::Constant(6.28318530717958648)};
};

/// Limits of the flange at the present configuration.
struct FlangeLimit {
  Eigen::Matrix<double, 6, 6> J;  ///< flange twist (m/s, then rad/s) = J * joint speeds
  double speed_m_s{0.0};
  double speed_rad_s{0.0};
};

/// A set-point that follows a target with feed-forward. The wanted closing speed is at most sqrt(a |d|), half of the
/// available deceleration a (the rest is left for the feed-forward), kGain |d|, which does not chatter, and the
/// greatest speed from which the set-point still stops at the target. The same bound holds against both joint limits,
/// with any target, feed-forward and length of the ticks: started inside its range, a joint never leaves it.
class JointGate {
 public:
  explicit JointGate(const JointLimits& limits) noexcept : limits_(limits) {}

  /// Starts from rest at `q_rad`.
  void reset(const Vector6& q_rad) noexcept;
  /// One tick of `dt` towards `q_d` moving with `qd_d`. Non-finite targets brake. Targets beyond the joint limits are
  /// clamped to them. With `flange`, the joint speeds are also kept to its limits, as far as acceleration and range
  /// allow.
  void follow(const Vector6& q_d_rad, const Vector6& qd_d_rad_s, double dt_s,
              const FlangeLimit* flange = nullptr) noexcept;
  /// One tick of braking with the full deceleration.
  void brake(double dt_s) noexcept;

  [[nodiscard]] const Vector6& q_rad() const noexcept { return q_rad_; }
  [[nodiscard]] const Vector6& qd_rad_s() const noexcept { return qd_rad_s_; }
  [[nodiscard]] bool at_rest() const noexcept { return qd_rad_s_.isZero(0.0); }
  [[nodiscard]] const JointLimits& limits() const noexcept { return limits_; }

 private:
  [[nodiscard]] Vector6 wanted_speed(const Vector6& q_d_rad, const Vector6& qd_d_rad_s, double dt_s) const noexcept;
  [[nodiscard]] Vector6 keep_flange_limit(const Vector6& qd_rad_s, double dt_s,
                                          const FlangeLimit& flange) const noexcept;
  void move(const Vector6& wanted_rad_s, double dt_s, const FlangeLimit* flange) noexcept;

  static constexpr double kGain = 30.0;  // 1/s

  JointLimits limits_;
  Vector6 q_rad_{Vector6::Zero()};
  Vector6 qd_rad_s_{Vector6::Zero()};
};

}  // namespace embody::safety
