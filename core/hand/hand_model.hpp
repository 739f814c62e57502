#pragma once
// Kinematics of a human hand of one shape, in MANO's parametrisation.
// Joint k turns by the rotation vector q[3k..3k+2] about axes that are parallel to M's in the rest pose; all rotations
// zero is the flat hand (Romero, Tzionas, Black 2017).
#include <array>

#include "core/base/result.hpp"
#include "core/base/static_vector.hpp"
#include "core/hand/hand_data.hpp"

namespace embody::hand {

inline constexpr std::size_t kMaxFingerPoints = 8;

using Vector9 = Eigen::Matrix<double, 9, 1>;
using Matrix9 = Eigen::Matrix<double, 9, 9>;
using PointJacobian = Eigen::Matrix<double, 3, 9>;

/// Points of each finger. [0] is the tip and [1] the middle point that the embodiment mapping follows; further ones are
/// where a glove carries its markers.
using HandPoints = std::array<StaticVector<HandPoint, kMaxFingerPoints>, kFingers>;

/// Tip and middle point of each finger: centres of markers on the nails and on the proximal phalanges (thumb: on its
/// proximal phalanx), 6 to 7 mm above the skin. For a MANO mesh: the vertices and offsets of the published record
/// mapping.
[[nodiscard]] HandPoints default_points(const HandData& data);

/// Error (kInvalidArgument) that names the first point that `data` cannot have: joint of another finger, vertex that
/// does not exist, not finite.
[[nodiscard]] Status check_points(const HandData& data, const HandPoints& points);

/// One finger in one configuration, with the wrist at rest.
struct FingerChain {
  Vector9 q_rad;                              ///< the angles
  std::array<Eigen::Vector3d, 3> centres_M;   ///< joint positions, m
  std::array<Eigen::Matrix3d, 3> R_M_parent;  ///< orientation of each joint's parent
  std::array<Eigen::Matrix3d, 3> R_MJ;        ///< orientation of each joint
  PointJacobian axes_M;                       ///< angular velocity per unit of each dq_i
};

/// Immutable after construction; every function is a pure function of its arguments, without heap.
class HandModel {
 public:
  /// The built-in right hand of mean shape with its default points.
  HandModel();
  /// @pre check_points(data, points)
  HandModel(const HandData& data, const Shape& shape, const HandPoints& points);

  [[nodiscard]] Side side() const noexcept { return side_; }
  /// Positions of the joints in the flat hand, M, MANO's order, m.
  [[nodiscard]] const std::array<Eigen::Vector3d, kHandModelJoints>& rest_joints() const noexcept { return joints_; }
  /// Ends of the fleshy finger tips in the flat hand, M, m, by Finger.
  [[nodiscard]] const std::array<Eigen::Vector3d, kFingers>& rest_tips() const noexcept { return tips_; }

  /// Joint frames X_MJ for the 48 pose parameters (wrist first); their axes are parallel to M's in the flat hand.
  [[nodiscard]] std::array<Pose, kHandModelJoints> joint_poses(const Vector48& q_rad) const noexcept;

  [[nodiscard]] std::size_t point_count(Finger finger) const noexcept {
    return points_[static_cast<std::size_t>(finger)].size();
  }
  /// How many of the finger's joints, from the knuckle, move the point: 0..3.
  [[nodiscard]] std::size_t joints_moving(Finger finger, std::size_t point) const noexcept;

  /// Joints of a finger for its nine rotation-vector components. About 0.2 us.
  [[nodiscard]] FingerChain chain(Finger finger, const Vector9& q_rad) const noexcept;
  /// Point of the finger in M, m.
  [[nodiscard]] Eigen::Vector3d point(Finger finger, std::size_t point, const FingerChain& chain) const noexcept;
  /// d point / d q, m/rad: analytic, pose correctives included.
  [[nodiscard]] PointJacobian jacobian(Finger finger, std::size_t point, const FingerChain& chain) const noexcept;
  /// Adds sum over the axes of c . (second derivative of the point with respect to q) to `curvature`, for a covector
  /// `c`; exact but for pose correctives, which it leaves out.
  void add_curvature(Finger finger, std::size_t point, const FingerChain& chain, const Eigen::Vector3d& c,
                     Matrix9& curvature) const noexcept;

  /// Last phalanx in M, m: [0] its joint, [1] the end of the fleshy tip.
  [[nodiscard]] std::array<Eigen::Vector3d, 2> distal(Finger finger, const FingerChain& chain) const noexcept;
  /// [0] tip, [1] middle, m.
  [[nodiscard]] std::array<Eigen::Vector3d, 2> finger_points(Finger finger, const Vector9& q_rad) const noexcept;

 private:
  // A skinned point is a weighted sum of points that are rigid with one bone each. Level -1 is the palm.
  struct Term {
    int level{-1};
    double weight{1.0};
    Eigen::Vector3d p_J{0.0, 0.0, 0.0};  // weight * (rest position - joint); level -1: weight * rest position
  };
  struct Point {
    StaticVector<Term, 4> terms;
    bool corrected{false};
    Eigen::Matrix<double, 3, 27> correctives;  // of the finger's own joints
  };

  [[nodiscard]] Point make_point(const HandData& data, const Shape& shape, std::size_t finger,
                                 const HandPoint& point) const;
  [[nodiscard]] const Point& at(Finger finger, std::size_t point) const noexcept {
    return points_[static_cast<std::size_t>(finger)][point];
  }

  Side side_{Side::kRight};
  std::array<Eigen::Vector3d, kHandModelJoints> joints_;
  std::array<Eigen::Vector3d, kFingers> tips_;
  std::array<StaticVector<Point, kMaxFingerPoints>, kFingers> points_;
};

}  // namespace embody::hand
