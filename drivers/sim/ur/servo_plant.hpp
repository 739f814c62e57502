#pragma once
// Joints that follow their set-point like a servoj stream: a critically damped second-order tracker, integrated exactly
// for a set-point that is constant over a cycle. On a ramp it lags by `lag`. Pure.
#include "core/hal/types.hpp"

namespace embody::sim {

/// Vendor maximum of the UR10e's joints: 120 deg/s (base, shoulder), 180 deg/s (others).
inline const Vector6 kUr10eMaxSpeed{2.0944, 2.0944, 3.1416, 3.1416, 3.1416, 3.1416};

struct ServoPlantConfig {
  Duration lag{std::chrono::milliseconds(50)};         ///< set-point to motion: look-ahead and servo
  Vector6 max_speed_rad_s = 1.5 * kUr10eMaxSpeed;      ///< what the motors could do at most
  Duration stop_time{std::chrono::milliseconds(300)};  ///< from the start of a stop to standstill
};

class ServoPlant {
 public:
  ServoPlant(const ServoPlantConfig& config, const Vector6& q_rad) noexcept : config_(config), q_rad_(q_rad) {}

  /// One cycle towards `q_set_rad`.
  void follow(const Vector6& q_set_rad, Duration dt) noexcept;
  /// One cycle of a stop: decelerates evenly to rest within `stop_time` of the first call and stays.
  void brake(Duration dt) noexcept;

  [[nodiscard]] const Vector6& q_rad() const noexcept { return q_rad_; }
  [[nodiscard]] const Vector6& qd_rad_s() const noexcept { return qd_rad_s_; }

 private:
  ServoPlantConfig config_;
  Vector6 q_rad_;
  Vector6 qd_rad_s_{Vector6::Zero()};
  Vector6 deceleration_rad_s2_{Vector6::Zero()};
  bool braking_{false};
};

}  // namespace embody::sim
