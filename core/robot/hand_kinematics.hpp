#pragma once
// Forward kinematics of points on a robotic hand as functions of its motor coordinates.
#include <Eigen/Core>
#include <array>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/math/pose.hpp"
#include "core/robot/coupling.hpp"
#include "core/robot/urdf_model.hpp"

namespace embody::robot {

inline constexpr std::size_t kMaxHandLinks = 64;
inline constexpr std::size_t kMaxHandPoints = 16;
inline constexpr std::size_t kMaxMotors = 32;

/// A value for the joint of that name.
struct NamedAngle {
  std::string joint;
  double angle_rad{0.0};
};

/// The joint of that name follows a motor through knots (Coupling).
struct NamedCoupling {
  std::string joint;
  std::string motor;
  std::vector<Knot> knots;
};

/// A point fixed to a link.
struct LinkPoint {
  std::string link;
  Eigen::Vector3d p_L{0.0, 0.0, 0.0};
};

/// Which joints move, which stand still, and which points are of interest.
struct HandKinematicsSpec {
  std::vector<std::string> motors;  ///< joints of that name, or names that `couplings` use; order of the coordinates
  std::vector<NamedAngle> fixed_joints;  ///< independent joints that stand still; those not named stand at 0
  std::vector<NamedAngle> zero_offsets;  ///< geometry angle = joint angle + offset
  std::vector<LinkPoint> points;
  /// Of independent joints that do not follow the motor of their name one to one.
  std::vector<NamedCoupling> couplings;
};

/// Immutable after create(). `r` are the motor coordinates (rad, or m for prismatic joints), P the root link.
class HandKinematics {
 public:
  /// 3 x motors, without heap.
  using Jacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, static_cast<int>(kMaxMotors)>;

  /// Poses of one configuration; the caller owns it, so that the kinematics stay immutable.
  struct Workspace {
    std::array<math::Pose, kMaxHandLinks> X_PL{};  ///< by link
    std::array<double, kMaxHandLinks> slopes{};    ///< by joint: dq/dr of its motor
  };

  /// Errors: kNotFound (link, joint or motor name), kInvalidArgument (a motor, coupled or fixed joint that is fixed,
  /// repeated or mimics another; knots that do not increase or leave the joint's limits; not finite), kUnsupported
  /// (more than the maxima above).
  [[nodiscard]] static Result<HandKinematics> create(const RobotModel& model, const HandKinematicsSpec& spec);

  [[nodiscard]] const RobotModel& model() const noexcept { return model_; }
  [[nodiscard]] std::size_t motor_count() const noexcept { return motor_count_; }
  [[nodiscard]] std::size_t point_count() const noexcept { return points_.size(); }
  /// By joint of the model.
  [[nodiscard]] std::span<const Coupling> couplings() const noexcept { return couplings_; }
  /// Geometry angle less joint angle, by joint of the model.
  [[nodiscard]] std::span<const double> zero_offsets() const noexcept { return zero_offsets_; }
  /// The moving joints between the root and the point whose angle depends on a motor, root first.
  [[nodiscard]] std::span<const std::size_t> point_joints(std::size_t point) const noexcept {
    return points_[point].joints;
  }

  /// Angles of all joints of the model (couplings, mimics, fixed values, without zero offsets), as a URDF viewer takes
  /// them; within the URDF's limits whatever `r` is.
  /// @pre r.size() >= motor_count(), q.size() >= model().joints.size()
  void joint_angles(std::span<const double> r, std::span<double> q) const noexcept;
  /// Computes the poses of all links. O(joints). @pre r.size() >= motor_count()
  void update(std::span<const double> r, Workspace& workspace) const noexcept;
  /// Point in P, m; after update().
  [[nodiscard]] Eigen::Vector3d point(std::size_t point, const Workspace& workspace) const noexcept;
  /// Derivative of point() by the motor coordinates, m/rad; after update().
  [[nodiscard]] Jacobian jacobian(std::size_t point, const Workspace& workspace) const noexcept;

 private:
  struct Point {
    std::size_t link{0};
    Eigen::Vector3d p_L{0.0, 0.0, 0.0};
    std::vector<std::size_t> joints;
  };

  HandKinematics() = default;

  RobotModel model_;
  std::size_t motor_count_{0};
  std::vector<Coupling> couplings_;
  std::vector<double> zero_offsets_;  // by joint
  std::vector<Point> points_;
};

}  // namespace embody::robot
