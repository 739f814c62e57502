#pragma once
// What the translation units of CalibrationProblem share.
#include <Eigen/Core>

#include "core/hand/calibration_problem.hpp"

namespace embody::hand::calibration {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Where the local variables of a finger block begin.
inline constexpr Index kSlip = 0, kShape = 6, kPose = 16, kHabit = 22, kPlaces = 32;

inline Index idx(std::size_t i) noexcept {
  return static_cast<Index>(i);
}

[[nodiscard]] inline Matrix3d cross(const Vector3d& v) noexcept {
  Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// d (position of the joint in the flat hand) / d shape.
[[nodiscard]] inline Eigen::Matrix<double, 3, 10> joint_direction(const HandData& data, std::size_t joint) {
  return data.joint_directions.middleRows<3>(3 * idx(joint));
}

template <class Square>
[[nodiscard]] double log_determinant(const Eigen::LLT<Square>& factor) noexcept {
  return 2.0 * factor.matrixLLT().diagonal().array().log().sum();
}

}  // namespace embody::hand::calibration
