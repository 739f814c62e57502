#pragma once
// Derivatives of the exponential map of SO(3) (Chirikjian 2012, eq. 10.86; Sola et al. 2018, eq. 145).
#include <Eigen/Core>

namespace embody::math {

/// Left Jacobian J_l: d/dt exp(w(t)) = [J_l(w) dw/dt]x exp(w). Equals the identity for w = 0.
[[nodiscard]] Eigen::Matrix3d left_jacobian_so3(const Eigen::Vector3d& w) noexcept;

/// Derivative of the covector m^T J_l(w): element (a, b) is d(m^T J_l(w) e_a)/dw_b. For second derivatives of rotated
/// points.
[[nodiscard]] Eigen::Matrix3d left_jacobian_derivative_so3(const Eigen::Vector3d& w, const Eigen::Vector3d& m) noexcept;

}  // namespace embody::math
