#pragma once
// Whether a controller's own geometry is that of the configured model (core/robot/ur_kinematics.hpp has the table).
#include "core/base/result.hpp"
#include "core/math/pose.hpp"
#include "core/robot/ur_kinematics.hpp"
#include "drivers/ur_rtde/primary_codec.hpp"

namespace embody::ur {

using robot::UrModel;

/// The model called `name`, upper and lower case alike. The error lists the known names.
[[nodiscard]] Result<const UrModel*> find_model(std::string_view name) noexcept;

[[nodiscard]] UrKinematics nominal_kinematics(const UrModel& model) noexcept;

/// X_BE: flange in the arm base.
[[nodiscard]] math::Pose flange_pose(const UrKinematics& kinematics, const math::Vector6& q_rad) noexcept;

/// Largest distance between the flanges of two geometries over a few fixed postures, m. Calibration makes some
/// millimetres of it, another model at least a centimetre and mostly a decimetre.
[[nodiscard]] double flange_distance_m(const UrKinematics& a, const UrKinematics& b) noexcept;

/// The model that comes nearest to what a controller of software `major`.x reports; null when none is near.
[[nodiscard]] const UrModel* identify_model(const UrKinematics& reported, int major) noexcept;

/// Fine when the controller reports the geometry of `configured`; otherwise one sentence with what it reports.
[[nodiscard]] Status check_model(const UrModel& configured, const UrKinematics& reported, int major) noexcept;

}  // namespace embody::ur
