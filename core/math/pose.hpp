#pragma once
// Rigid-body poses and their exponential coordinates: pure functions, no allocation, no exceptions.
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace embody::math {

/// X_AB: pose of frame B measured and expressed in frame A (docs/notation.md).
using Pose = Eigen::Isometry3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;

/// Rotation matrix of the rotation vector `w` (axis times angle, rad). Exact for w = 0.
[[nodiscard]] Eigen::Matrix3d exp_so3(const Eigen::Vector3d& w) noexcept;

/// Rotation vector (axis times angle, rad, norm in [0, pi]) of the rotation matrix `R`.
[[nodiscard]] Eigen::Vector3d log_so3(const Eigen::Matrix3d& R) noexcept;

/// Pose with exponential coordinates S = [w, v] (rotation vector first; Lynch & Park, Modern Robotics, eq. 3.88):
/// R = exp([w]x), p = V(w) v.
[[nodiscard]] Pose exp_se3(const Vector6& S) noexcept;

/// Pose from a translation (m) and a rotation vector (rad), the layout of a UR TCP pose.
[[nodiscard]] Pose pose_from(const Eigen::Vector3d& p, const Eigen::Vector3d& rotation_vector) noexcept;

/// Angle in [0, pi] between two orientations, rad.
[[nodiscard]] double angle_between(const Eigen::Matrix3d& R_WA, const Eigen::Matrix3d& R_WB) noexcept;

/// Pose on the way from `X_WA` (s = 0) to `X_WB` (s = 1): straight line and shortest rotation. s outside [0,1]
/// extrapolates.
[[nodiscard]] Pose interpolate(const Pose& X_WA, const Pose& X_WB, double s) noexcept;

/// True when all numbers are finite and the rotation is orthonormal within 1e-6.
[[nodiscard]] bool is_valid(const Pose& X) noexcept;

}  // namespace embody::math
