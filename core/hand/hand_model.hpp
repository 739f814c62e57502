#pragma once
// Kinematic model of a right hand in MANO's parametrisation, without any of MANO's data.
// Frame M follows MANO's conventions: fingers -x, dorsal +y, thumb +z, metres; all rotations zero is the flat hand.
// Joint k turns by the rotation vector q[3k..3k+2] about axes that are parallel to M's in the rest pose
// (Romero, Tzionas, Black 2017).
#include <array>

#include "core/hal/types.hpp"

namespace embody::hand {

inline constexpr std::size_t kHandModelJoints = 16;  ///< wrist, then 3 per finger: index, middle, little, ring, thumb
inline constexpr std::size_t kHandShapeParameters = 10;

using Vector9 = Eigen::Matrix<double, 9, 1>;
using Vector48 = Eigen::Matrix<double, 48, 1>;
using Matrix9 = Eigen::Matrix<double, 9, 9>;
using PointJacobian = Eigen::Matrix<double, 3, 9>;

/// First of the three joints of a finger in MANO's order of 16 joints.
[[nodiscard]] constexpr std::size_t first_joint(Finger finger) noexcept {
  return 1 + kFingerOffset[static_cast<std::size_t>(finger)] / 3;
}

enum class Skeleton {
  kBoneLengths,  ///< mean bone lengths of 66 X-rays (Buryanov & Kotiuk 2010), hand length 190.7 mm to the middle tip
  kWebXr,        ///< joints of the WebXR generic hand asset (MIT), hand length 190.2 mm
};

/// Element of HandModelConfig::shape: a relative change, e.g. 0.05 = 5 % more. All zero is the reference skeleton.
enum class HandShape : std::size_t {
  kScale,        ///< everything, about the wrist
  kPalmBreadth,  ///< knuckles across the palm (z)
  kPalmLength,   ///< knuckles along the palm (x)
  kThumbLength,  ///< phalanges of a finger, along the finger
  kIndexLength,
  kMiddleLength,
  kRingLength,
  kLittleLength,
  kGirth,         ///< distance of marker points from the bones, height of the knuckles (y)
  kDistalLength,  ///< last phalanx of every finger, on top of the finger's length
};

/// Where a marker is fixed: on the bone that turns with `joint` (MANO's order), at `p_rest_M` in the flat hand of the
/// reference shape, m. The point moves with the bone when the shape changes.
struct MarkerAttachment {
  std::size_t joint{0};
  Eigen::Vector3d p_rest_M{0.0, 0.0, 0.0};
};

/// [finger][0] tip, [finger][1] middle.
using MarkerAttachments = std::array<std::array<MarkerAttachment, 2>, kFingers>;

/// The marker placement of a 13-marker glove: tip markers on the nails, middle markers on the proximal phalanges
/// (thumb: on its proximal phalanx), centres about 6 to 7 mm above the skin.
[[nodiscard]] MarkerAttachments default_attachments(Skeleton skeleton) noexcept;

struct HandModelConfig {
  Skeleton skeleton{Skeleton::kBoneLengths};
  Eigen::Matrix<double, kHandShapeParameters, 1> shape{Eigen::Matrix<double, kHandShapeParameters, 1>::Zero()};
  MarkerAttachments attachments{default_attachments(Skeleton::kBoneLengths)};
};

/// The two marker points of a finger, their first derivatives with respect to the finger's nine angles, and what the
/// second derivatives need.
struct FingerKinematics {
  std::array<Eigen::Vector3d, 2> p_M;         ///< [0] tip, [1] middle, m
  std::array<PointJacobian, 2> J;             ///< dp_M/dq, m/rad
  Vector9 q_rad;                              ///< the angles
  PointJacobian axes_M;                       ///< angular velocity per unit of each dq_i
  std::array<Eigen::Vector3d, 3> centres_M;   ///< joint positions, m
  std::array<Eigen::Matrix3d, 3> R_M_parent;  ///< orientation of each joint's parent
  std::array<std::size_t, 2> level;           ///< last of the finger's joints (0..2) that moves the point
};

/// Adds sum over the axes of c . (second derivative of p_M[point] with respect to q) to `curvature`, for a covector
/// `c`.
void add_curvature(const FingerKinematics& kinematics, std::size_t point, const Eigen::Vector3d& c,
                   Matrix9& curvature) noexcept;

/// Immutable after construction; every function is a pure function of its arguments, without heap.
class HandModel {
 public:
  explicit HandModel(const HandModelConfig& config = {}) noexcept;

  /// Positions of the joints in the flat hand, M, MANO's order, m.
  [[nodiscard]] const std::array<Eigen::Vector3d, kHandModelJoints>& rest_joints() const noexcept { return joints_; }
  /// Ends of the fleshy finger tips in the flat hand, M, m, by Finger.
  [[nodiscard]] const std::array<Eigen::Vector3d, kFingers>& rest_tips() const noexcept { return tips_; }

  /// Joint frames X_MJ for the 48 pose parameters (wrist first); their axes are parallel to M's in the flat hand.
  [[nodiscard]] std::array<Pose, kHandModelJoints> joint_poses(const Vector48& q_rad) const noexcept;

  /// How many of the finger's joints, from the knuckle, move its marker point: 1..3.
  [[nodiscard]] std::size_t joints_moving(Finger finger, std::size_t point) const noexcept {
    return attachments_[static_cast<std::size_t>(finger)][point].level + 1;
  }

  /// Marker points of one finger with the wrist at rest, [0] tip, [1] middle, m. `q_rad`: the finger's nine
  /// rotation-vector components.
  [[nodiscard]] std::array<Eigen::Vector3d, 2> finger_points(Finger finger, const Vector9& q_rad) const noexcept;

  /// As finger_points, with analytic derivatives. Well below a microsecond.
  [[nodiscard]] FingerKinematics finger_kinematics(Finger finger, const Vector9& q_rad) const noexcept;

 private:
  struct Attachment {
    std::size_t level{0};                ///< 0..2: joint within the finger
    Eigen::Vector3d p_J{0.0, 0.0, 0.0};  ///< offset from that joint in the flat hand
  };

  std::array<Eigen::Vector3d, kHandModelJoints> joints_;
  std::array<Eigen::Vector3d, kFingers> tips_;
  std::array<std::array<Attachment, 2>, kFingers> attachments_;
};

}  // namespace embody::hand
