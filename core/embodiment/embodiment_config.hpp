#pragma once
// How a robotic hand follows a human hand: the content of config/hands/*.toml, field for key.
#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "core/hal/types.hpp"

namespace embody {

/// Pose of the thumb's opposition joint, which the mapping does not move.
enum class ThumbMode : std::uint8_t {
  kOpposed,  ///< "opposed": in front of the palm
  kLateral,  ///< "lateral": beside the index finger
};

/// The two points of a robot finger that follow the human finger's tip and middle marker.
struct FingerPoints {
  std::string link;                      ///< URDF link that carries both points; empty: the hand lacks the finger
  Eigen::Vector3d tip_m{0.0, 0.0, 0.0};  ///< in the link frame
  Eigen::Vector3d middle_m{0.0, 0.0, 0.0};
};

struct EmbodimentConfig {
  std::string name;       ///< of the hand, for people
  std::string urdf;       ///< file name, relative to the TOML file
  std::string root_link;  ///< P; must be the root of the URDF
  /// Exponential coordinates [w, v] of X_PM (rad, m): hand-model base in the root link.
  Vector6 X_PM{Vector6::Zero()};

  /// URDF joints that have a motor of their own, in the order of FingerTarget::q_rad. Joints that mimic them follow.
  std::vector<std::string> motors;
  /// Range of each motor, rad; intersected with the URDF's limits. Same length as `motors`.
  std::vector<double> motor_lower_rad;
  std::vector<double> motor_upper_rad;

  ThumbMode thumb_mode{ThumbMode::kOpposed};
  std::string thumb_joint;  ///< opposition joint; empty: the hand has none
  double thumb_opposed_rad{0.0};
  double thumb_lateral_rad{0.0};

  /// Rotates the zero of `zero_offset_joints` about their axes: geometry angle = joint angle + offset.
  double finger_zero_offset_rad{0.0};
  std::vector<std::string> zero_offset_joints;

  /// Tables [thumb], [index], [middle], [ring], [little].
  std::array<FingerPoints, kFingers> fingers;
};

}  // namespace embody
