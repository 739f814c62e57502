#pragma once
// How a robotic hand follows a human hand: the content of config/hands/*.toml, field for key.
#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "core/hal/types.hpp"

namespace embody {

/// Which branch the motor that moves the thumb sideways is on (EmbodimentConfig::thumb_motor).
enum class ThumbMode : std::uint8_t {
  kOpposed,    ///< "opposed": its positive half, thumb in front of the palm
  kLateral,    ///< "lateral": its negative half, thumb beside the index finger
  kAutomatic,  ///< "automatic": the half that fits better, with hysteresis and a least dwell
};

/// A piece of the palmar surface of a robot finger: along the axis from..to in the frame of `link`.
struct ContactPad {
  std::string link;
  Eigen::Vector3d from_m{0.0, 0.0, 0.0};  ///< nearer to the palm
  Eigen::Vector3d to_m{0.0, 0.0, 0.0};    ///< nearer to the tip
  double radius_m{0.0};                   ///< of the finger about the axis
  Eigen::Vector3d facing{0.0, 0.0, 0.0};  ///< where the pad looks: out of the finger, across the axis
  double width_m{0.0};  ///< 0: round, the half of the capsule that faces `facing`; else a flat rectangle of this width
};

/// The two points of a robot finger that follow the human finger's tip and middle marker.
struct FingerPoints {
  std::string link;                      ///< URDF link that carries the tip point; empty: the hand lacks the finger
  Eigen::Vector3d tip_m{0.0, 0.0, 0.0};  ///< in the frame of `link`
  Eigen::Vector3d middle_m{0.0, 0.0, 0.0};
  std::string middle_link;       ///< URDF link that carries the middle point; empty: `link`
  std::vector<ContactPad> pads;  ///< the first is the finger tip's: pinches, orientation and collisions go by it
};

/// joint angle = piecewise linear function of a motor's coordinate; constant beyond the knots.
struct JointCoupling {
  std::string joint;              ///< URDF joint
  std::string motor;              ///< of EmbodimentConfig::motors
  std::vector<double> motor_rad;  ///< knots, increasing
  std::vector<double> joint_rad;  ///< the joint's angle there
};

struct EmbodimentConfig {
  std::string name;         ///< of the hand, for people
  std::string urdf;         ///< file name, relative to the TOML file
  std::string root_link;    ///< P; must be the root of the URDF
  Side side{Side::kRight};  ///< of the robot hand that is driven; a file of the other side is mirrored
  /// Side that the URDF and every number of this file describe.
  Side file_side{Side::kRight};
  /// Exponential coordinates [w, v] of X_PM (rad, m): hand-model base in the root link.
  Vector6 X_PM{Vector6::Zero()};

  /// Coordinates that the hand driver commands, in its order: a URDF joint of that name, or any name that `couplings`
  /// use. A motor's own joint may be coupled as well (Mia: index crank). Joints that mimic follow.
  std::vector<std::string> motors;
  /// Range of each motor, rad; intersected with the URDF's limits of the joints that it moves. Same length as `motors`.
  std::vector<double> motor_lower_rad;
  std::vector<double> motor_upper_rad;
  std::vector<JointCoupling> couplings;

  ThumbMode thumb_mode{ThumbMode::kOpposed};
  std::string thumb_motor;  ///< motor whose sign is the thumb's branch; empty: the hand has none
  /// Opposed, the thumb's motor stays above this: where its couplings have brought the thumb in front of the palm. The
  /// little way before that would only trade the thumb's place against the other finger's.
  double thumb_opposed_from_rad{0.0};

  /// Rotates the zero of `zero_offset_joints` about their axes: geometry angle = joint angle + offset.
  double finger_zero_offset_rad{0.0};
  std::vector<std::string> zero_offset_joints;

  /// Additions to the paper's objective, each 0 = off.
  double orientation_m{0.0};       ///< weight of the finger tips' directions: 1 rad costs as much as this distance
  double pinch_m{0.0};             ///< below this distance of human thumb and finger their distance is kept, too
  double temporal_m_rad{0.0};      ///< weight of a motor's change in 10 ms where the points hardly tell its angle
  double collision_margin_m{0.0};  ///< finger tips keep this distance from each other (0 also for touching pinches)

  /// Tables [thumb], [index], [middle], [ring], [little].
  std::array<FingerPoints, kFingers> fingers;
};

}  // namespace embody
