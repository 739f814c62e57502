#pragma once
// Forward kinematics of points on a robotic hand as functions of its motor coordinates.
#include <Eigen/Core>
#include <array>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/math/pose.hpp"
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

/// A point fixed to a link.
struct LinkPoint {
  std::string link;
  Eigen::Vector3d p_L{0.0, 0.0, 0.0};
};

/// Which joints move, which stand still, and which points are of interest.
struct HandKinematicsSpec {
  std::vector<std::string> motors;       ///< independent joints, in the order of the motor coordinates
  std::vector<NamedAngle> fixed_joints;  ///< independent joints that stand still; those not named stand at 0
  std::vector<NamedAngle> zero_offsets;  ///< geometry angle = joint angle + offset
  std::vector<LinkPoint> points;
};

/// How one joint follows the motors: q = multiplier * r[motor] + offset, or q = offset when `motor` is kNoIndex.
struct Coupling {
  std::size_t motor{kNoIndex};
  double multiplier{0.0};
  double offset{0.0};
};

/// Immutable after create(). `r` are the motor coordinates (rad, or m for prismatic joints), P the root link.
class HandKinematics {
 public:
  /// 3 x motors, without heap.
  using Jacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, static_cast<int>(kMaxMotors)>;

  /// Poses of one configuration; the caller owns it, so that the kinematics stay immutable.
  struct Workspace {
    std::array<math::Pose, kMaxHandLinks> X_PL{};  ///< by link
  };

  /// Errors: kNotFound (link or joint name), kInvalidArgument (a motor or fixed joint that is fixed, repeated or
  /// mimics another; not finite), kUnsupported (more than the maxima above).
  [[nodiscard]] static Result<HandKinematics> create(const RobotModel& model, const HandKinematicsSpec& spec);

  [[nodiscard]] const RobotModel& model() const noexcept { return model_; }
  [[nodiscard]] std::size_t motor_count() const noexcept { return motor_joints_.size(); }
  [[nodiscard]] std::size_t point_count() const noexcept { return points_.size(); }
  /// By joint of the model.
  [[nodiscard]] std::span<const Coupling> couplings() const noexcept { return couplings_; }
  /// Index of the motor's joint in the model.
  [[nodiscard]] std::size_t motor_joint(std::size_t motor) const noexcept { return motor_joints_[motor]; }
  /// The moving joints between the root and the point whose angle depends on a motor, root first.
  [[nodiscard]] std::span<const std::size_t> point_joints(std::size_t point) const noexcept {
    return points_[point].joints;
  }

  /// Angles of all joints of the model (mimics, fixed values, without zero offsets), as a URDF viewer takes them.
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
  std::vector<std::size_t> motor_joints_;
  std::vector<Coupling> couplings_;
  std::vector<double> zero_offsets_;  // by joint
  std::vector<Point> points_;
};

}  // namespace embody::robot
