#pragma once
// Motor counts of a Mia hand <-> joint angles of its URDF. Pure functions, no allocation.
// Source of the default numbers: Prensilia's published ROS drivers (mia_hand_ros_control and mia_hand_ros2_pkgs).
#include <array>
#include <cstddef>

#include "core/base/result.hpp"

namespace embody::mia {

/// Motors in the order of the joint names j_thumb_fle, j_index_fle, j_mrl_fle.
enum class Motor : unsigned char { kThumb, kIndex, kMrl };
inline constexpr std::size_t kMotors = 3;
inline constexpr std::array<const char*, kMotors> kJointNames{"j_thumb_fle", "j_index_fle", "j_mrl_fle"};
inline constexpr int kMaxCounts = 255;  ///< 0 open .. 255 closed; the index also turns to -255
inline constexpr std::size_t kIndexKnots = 13;

/// angle = rad_per_count * (counts - zero_counts)
struct LinearTransmission {
  double rad_per_count{1.0};
  double zero_counts{0.0};
};

/// The index crank. Piecewise linear between the knots, straight on beyond them. `delta` is signed: its magnitude is
/// the index flexion, its sign the branch of the thumb (positive: opposed to the fingers, negative: lateral).
/// The default knots are a continuous and monotone fit of the vendor's table within 0.001 rad.
struct IndexTransmission {
  double zero_counts{0.0};  ///< per-hand offset, added to every knot
  std::array<double, kIndexKnots> counts{-255.0, -210.49, -152.93, -104.23, -62.90, -18.63, 41.88,
                                         61.07,  80.25,   108.29,  155.52,  192.42, 255.0};
  std::array<double, kIndexKnots> delta_rad{-1.37619, -1.04894, -0.68085, -0.40347, -0.20126, -0.04421, 0.03699,
                                            0.11422,  0.23177,  0.45352,  0.84563,  1.10417,  1.43636};
};

/// Every hand ships with its own calibration; these are the vendor's defaults.
struct Transmission {
  LinearTransmission thumb{11.3895 / 2560.0, 0.0};
  IndexTransmission index;
  LinearTransmission mrl{7.0074 / 1280.0, 0.0};
};

/// Checks that every number is finite, scales are positive and knots rise strictly. Errors: kInvalidArgument.
[[nodiscard]] Status check(const Transmission& transmission) noexcept;

/// Signed crank angle (rad) of the index motor. @pre check(transmission) passed
[[nodiscard]] double index_delta_rad(const IndexTransmission& index, double counts) noexcept;
/// Inverse of index_delta_rad().
[[nodiscard]] double index_counts(const IndexTransmission& index, double delta_rad) noexcept;

/// Motor coordinates (rad, order of kJointNames) at the given motor counts: thumb flexion, the index crank's signed
/// delta, flexion of middle, ring and little finger.
[[nodiscard]] std::array<double, kMotors> joint_angles_rad(const Transmission& transmission,
                                                           const std::array<double, kMotors>& counts) noexcept;
/// Inverse of joint_angles_rad().
[[nodiscard]] std::array<double, kMotors> motor_counts(const Transmission& transmission,
                                                       const std::array<double, kMotors>& q_rad) noexcept;

/// Angle of the passive joint j_thumb_opp (rad, in [-0.6283, 0]) that belongs to the index crank angle.
[[nodiscard]] double thumb_opposition_rad(double delta_rad) noexcept;

}  // namespace embody::mia
