#pragma once
// Kinematics of Universal Robots arms (three parallel joints, offset wrist): pure functions, no heap, no exceptions.
// Geometry is nominal: each arm carries factory calibration deltas, so a nominal pose differs from the controller's by
// some millimetres. Use it for relative motion, or correct with a measured base pose.
#include <array>
#include <cstdint>

#include "core/base/result.hpp"
#include "core/base/static_vector.hpp"
#include "core/math/pose.hpp"

namespace embody::robot {

using math::Pose;
using math::Vector6;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Lengths of the Denavit-Hartenberg table (standard convention), m. Link twists are pi/2, 0, 0, pi/2, -pi/2, 0.
struct UrGeometry {
  double d1_m{0.0};
  double a2_m{0.0};  ///< negative, as in the vendor's table
  double a3_m{0.0};  ///< negative
  double d4_m{0.0};
  double d5_m{0.0};
  double d6_m{0.0};
};

/// An arm that can be bought. Source of the lengths: Universal Robots, "DH parameters for calculations of kinematics
/// and dynamics" (nominal values).
struct UrModel {
  const char* name;
  int software_major;  ///< 3: CB-Series, 5: e-Series
  UrGeometry geometry;
};
enum class UrArm : std::uint8_t { kUr3e, kUr5e, kUr10e, kUr16e, kUr3, kUr5, kUr10 };
inline constexpr std::array<UrModel, 7> kUrModels{{
    {"ur3e", 5, {0.15185, -0.24355, -0.2132, 0.13105, 0.08535, 0.0921}},
    {"ur5e", 5, {0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996}},
    {"ur10e", 5, {0.1807, -0.6127, -0.57155, 0.17415, 0.11985, 0.11655}},
    {"ur16e", 5, {0.1807, -0.4784, -0.36, 0.17415, 0.11985, 0.11655}},
    {"ur3", 3, {0.1519, -0.24365, -0.21325, 0.11235, 0.08535, 0.0819}},
    {"ur5", 3, {0.089159, -0.425, -0.39225, 0.10915, 0.09465, 0.0823}},
    {"ur10", 3, {0.1273, -0.612, -0.5723, 0.163941, 0.1157, 0.0922}},
}};
inline constexpr auto kUrModelNames = [] {
  std::array<const char*, kUrModels.size()> names{};
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = kUrModels[i].name;
  return names;
}();
[[nodiscard]] constexpr const UrModel& model_of(UrArm arm) noexcept {
  return kUrModels[static_cast<std::size_t>(arm)];
}
inline constexpr UrGeometry kUr10e = model_of(UrArm::kUr10e).geometry;

inline constexpr std::size_t kMaxUrSolutions = 8;
using UrSolutions = StaticVector<Vector6, kMaxUrSolutions>;

/// Range and weights for the choice among the solutions of the inverse kinematics.
struct UrJointRange {
  Vector6 lower_rad{Vector6::Constant(-6.283185307179586)};
  Vector6 upper_rad{Vector6::Constant(6.283185307179586)};
  Vector6 weights{Vector6::Ones()};  ///< of the squared joint differences; > 0
};

/// X_BE: flange (DH frame 6, not the active tool centre point) in the arm base for joint angles `q_rad`.
[[nodiscard]] Pose forward_kinematics(const Vector6& q_rad, const UrGeometry& geometry = kUr10e) noexcept;

/// All joint angles in (-pi, pi] that reach `X_BE`: up to 8, none when the pose is out of reach or not a finite rigid
/// pose. Poses on the border of the workspace (arm stretched, wrist centre on the shoulder cylinder) count as
/// reachable within 1e-9 of the cosine. When the wrist is singular (sin(q5) = 0), joint 6 is free: it keeps
/// `q6_near_rad`. Exact: forward_kinematics of a solution equals `X_BE` within 1e-9.
[[nodiscard]] UrSolutions inverse_kinematics(const Pose& X_BE, double q6_near_rad,
                                             const UrGeometry& geometry = kUr10e) noexcept;

/// The solution nearest to `q_near_rad`: every angle is turned by full turns to the copy inside the range that is
/// nearest to `q_near_rad`, then the least weighted sum of squared differences wins.
/// Errors: kInvalidArgument (not finite), kNotFound (out of reach, or every solution breaks a joint limit).
/// The caller compares the step with its speed limit: near a singularity even the nearest solution may be far.
[[nodiscard]] Result<Vector6> solve_nearest(const Pose& X_BE, const Vector6& q_near_rad, const UrJointRange& range = {},
                                            const UrGeometry& geometry = kUr10e) noexcept;

/// Geometric Jacobian of the flange origin, expressed in B: [v_BE; w_BE] = J * qd (m/s first, then rad/s: the layout of
/// UR's tool speed).
[[nodiscard]] Matrix6 jacobian(const Vector6& q_rad, const UrGeometry& geometry = kUr10e) noexcept;

/// |det J| in closed form, m^3: |s3 s5 a2 a3 (a2 c2 + a3 c23 + d5 s234)|. Zero at the elbow, wrist and shoulder
/// singularity (first, second, last factor).
[[nodiscard]] double manipulability(const Vector6& q_rad, const UrGeometry& geometry = kUr10e) noexcept;

}  // namespace embody::robot
