#include "core/math/so3_jacobian.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/math/pose.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::math {
namespace {

// Rotation vectors from far below to far above the switch between series and closed form.
Eigen::Vector3d any_rotation(test::RandomValues& random) {
  return std::pow(10.0, random(-5.0, 0.5)) * random.rotation(1.0).normalized();
}

TEST(LeftJacobian, IsTheAngularVelocityPerUnitOfTheRotationVector) {
  test::RandomValues random(11);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 5'000; ++i) {
    const Eigen::Vector3d w = any_rotation(random);
    const Eigen::Matrix3d J = left_jacobian_so3(w);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d h = kStep * Eigen::Vector3d::Unit(k);
      const Eigen::Vector3d turned = log_so3(exp_so3(w + h) * exp_so3(w - h).transpose()) / (2.0 * kStep);
      ASSERT_LT((J.col(k) - turned).norm(), 1e-8) << "w = " << w.transpose();
    }
  }
  EXPECT_EQ(left_jacobian_so3(Eigen::Vector3d::Zero()), Eigen::Matrix3d::Identity());
}

TEST(LeftJacobianDerivative, EqualsFiniteDifferencesOfTheLeftJacobian) {
  test::RandomValues random(12);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 5'000; ++i) {
    const Eigen::Vector3d w = any_rotation(random);
    const Eigen::Vector3d m = random.vector<3>(-1.0, 1.0);
    const Eigen::Matrix3d D = left_jacobian_derivative_so3(w, m);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d h = kStep * Eigen::Vector3d::Unit(k);
      const Eigen::Vector3d difference =
          (left_jacobian_so3(w + h) - left_jacobian_so3(w - h)).transpose() * m / (2.0 * kStep);
      ASSERT_LT((D.col(k) - difference).norm(), 1e-8) << "w = " << w.transpose();
    }
  }
}

}  // namespace
}  // namespace embody::math
