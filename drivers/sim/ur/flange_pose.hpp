#pragma once
// Forward kinematics of the nominal UR10e, for the pose that the simulated controller reports. Pure.
#include "core/math/pose.hpp"

namespace embody::sim {

/// X_BE of the UR10e at `q_rad`, nominal Denavit-Hartenberg parameters (Universal Robots, "DH parameters for
/// calculations of kinematics and dynamics"); a real arm differs by its calibration.
[[nodiscard]] math::Pose ur10e_flange_pose(const math::Vector6& q_rad) noexcept;

}  // namespace embody::sim
