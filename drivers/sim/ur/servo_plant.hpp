#pragma once
// Joints that follow their set-point like a servoj stream: a critically damped second-order tracker, integrated exactly
// for a set-point that is constant over a cycle. On a ramp it lags by servo_lag(). Pure.
#include "core/hal/types.hpp"

namespace embody::sim {

/// Vendor maximum of the UR10e's joints: 120 deg/s (base, shoulder), 180 deg/s (others).
inline const Vector6 kUr10eMaxSpeed{2.0944, 2.0944, 3.1416, 3.1416, 3.1416, 3.1416};

struct ServoPlantConfig {
  Vector6 max_speed_rad_s = 1.5 * kUr10eMaxSpeed;      ///< what the motors could do at most
  Duration stop_time{std::chrono::milliseconds(300)};  ///< from the start of a stop to standstill
};

/// Set-point to motion for the arguments of servoj: nine tenths of the look-ahead time and 6 s / gain. Fitted to two
/// figures from users of real robots (34 ms at 0.03 s and 1200; about 100 ms at 0.1 s and 300); not measured by us.
[[nodiscard]] Duration servo_lag(double lookahead_s, double gain) noexcept;

class ServoPlant {
 public:
  ServoPlant(const ServoPlantConfig& config, const Vector6& q_rad) noexcept : config_(config), q_rad_(q_rad) {}

  /// One cycle towards `q_set_rad`.
  void follow(const Vector6& q_set_rad, Duration lag, Duration dt) noexcept;
  /// One cycle of a stop: decelerates evenly to rest within `stop_time` of the first call and stays.
  void brake(Duration dt) noexcept;
  /// One cycle of a stop at this deceleration of each joint.
  void decelerate(double deceleration_rad_s2, Duration dt) noexcept;

  [[nodiscard]] const Vector6& q_rad() const noexcept { return q_rad_; }
  [[nodiscard]] const Vector6& qd_rad_s() const noexcept { return qd_rad_s_; }

 private:
  void slow_down(const Vector6& deceleration_rad_s2, Duration dt) noexcept;

  ServoPlantConfig config_;
  Vector6 q_rad_;
  Vector6 qd_rad_s_{Vector6::Zero()};
  Vector6 deceleration_rad_s2_{Vector6::Zero()};
  bool braking_{false};
};

}  // namespace embody::sim
