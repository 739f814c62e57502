#pragma once
// The hand on the other side: mirror image of a robot model.
#include <Eigen/Core>

#include "core/math/pose.hpp"
#include "core/robot/urdf_model.hpp"

namespace embody::robot {

/// Reflection at the plane x = 0, S = diag(-1, 1, 1): a point (or a direction between points) p becomes S p.
[[nodiscard]] Eigen::Vector3d mirrored(const Eigen::Vector3d& p) noexcept;

/// Mirror image of a pose: S X S, again a rotation with its translation.
[[nodiscard]] math::Pose mirrored(const math::Pose& X_AB) noexcept;

/// Exponential coordinates [w, v] of the mirror image: [-S w, S v]. Exact: exp_se3(mirrored_exponential(c)) equals
/// mirrored(exp_se3(c)), because a rotation vector is an axial vector.
[[nodiscard]] math::Vector6 mirrored_exponential(const math::Vector6& w_v) noexcept;

/// Mirror image at the plane x = 0 of the root link; every link's own frame is reflected the same way. Names, order,
/// limits and mimics stay, and the same joint angles give the mirror-image posture: with X_PL the pose of a link in
/// the root, X_PL(mirrored(model), q) = S X_PL(model, q) S for every q. A left hand made of a right one therefore
/// keeps joint names such as "rh_FFJ3". mirrored(mirrored(model)) equals model. Allocates the copy.
[[nodiscard]] RobotModel mirrored(const RobotModel& model);

}  // namespace embody::robot
