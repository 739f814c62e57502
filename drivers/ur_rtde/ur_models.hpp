#pragma once
// The arms of Universal Robots by name: nominal geometry, and whether a controller's own geometry is that of the
// configured model. Source of the table: Universal Robots, "DH parameters for calculations of kinematics and dynamics".
#include <span>

#include "core/base/result.hpp"
#include "core/math/pose.hpp"
#include "drivers/ur_rtde/primary_codec.hpp"

namespace embody::ur {

/// Nominal Denavit-Hartenberg lengths (standard convention), m; the twists of all arms are pi/2, 0, 0, pi/2, -pi/2, 0.
struct UrModel {
  std::string_view name;
  int first_major{5};  ///< 3: CB-Series (software 3.x), 5: e-Series
  double d1_m{0.0};
  double a2_m{0.0};  ///< negative, as in the vendor's table
  double a3_m{0.0};  ///< negative
  double d4_m{0.0};
  double d5_m{0.0};
  double d6_m{0.0};
};

[[nodiscard]] std::span<const UrModel> ur_models() noexcept;

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
