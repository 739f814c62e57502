#include "core/math/pose.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/unit/math/random_values.hpp"

namespace embody::math {
namespace {

constexpr double kPi = 3.14159265358979323846;

Eigen::Matrix3d skew(const Eigen::Vector3d& w) {
  Eigen::Matrix3d S;
  S << 0.0, -w.z(), w.y(), w.z(), 0.0, -w.x(), -w.y(), w.x(), 0.0;
  return S;
}

TEST(ExpSo3, EqualsEigensAngleAxisForAnyRotationVector) {
  test::RandomValues random(1);
  for (int i = 0; i < 10'000; ++i) {
    const double scale = std::pow(10.0, random(-9.0, 0.9));  // tiny to beyond two turns
    const Eigen::Vector3d w = scale * random.vector<3>(-1.0, 1.0);
    const Eigen::Matrix3d expected = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix();
    ASSERT_LT((exp_so3(w) - expected).cwiseAbs().maxCoeff(), 1e-12) << "w = " << w.transpose();
  }
  EXPECT_EQ(exp_so3(Eigen::Vector3d::Zero()), Eigen::Matrix3d::Identity());
}

TEST(LogSo3, InvertsTheExponentialUpToHalfATurn) {
  test::RandomValues random(2);
  for (int i = 0; i < 10'000; ++i) {
    const Eigen::Vector3d w = random.rotation(kPi - 1e-6);
    ASSERT_LT((log_so3(exp_so3(w)) - w).norm(), 1e-9) << "w = " << w.transpose();
  }
  for (const double angle : {0.0, 1e-15, 1e-9, 1e-5, 1e-4}) {
    const Eigen::Vector3d w(0.0, angle, 0.0);
    EXPECT_LT((log_so3(exp_so3(w)) - w).norm(), 1e-15) << angle;
  }
}

TEST(LogSo3, ReturnsHalfATurnAboutEitherEndOfTheAxis) {
  test::RandomValues random(3);
  for (int i = 0; i < 1'000; ++i) {
    const Eigen::Vector3d axis = random.rotation(1.0).normalized();
    const Eigen::Vector3d w = log_so3(exp_so3(kPi * axis));
    ASSERT_NEAR(w.norm(), kPi, 1e-9);
    ASSERT_NEAR(std::abs(w.normalized().dot(axis)), 1.0, 1e-9);
  }
}

TEST(ExpSe3, EqualsThePowerSeriesOfTheTwist) {
  test::RandomValues random(4);
  for (int i = 0; i < 2'000; ++i) {
    const double scale = std::pow(10.0, random(-7.0, 0.4));
    Vector6 S = random.vector<6>(-1.0, 1.0);
    S.head<3>() *= scale;
    Eigen::Matrix4d twist = Eigen::Matrix4d::Zero();
    twist.topLeftCorner<3, 3>() = skew(S.head<3>());
    twist.topRightCorner<3, 1>() = S.tail<3>();
    Eigen::Matrix4d series = Eigen::Matrix4d::Identity();
    Eigen::Matrix4d term = Eigen::Matrix4d::Identity();
    for (int k = 1; k < 40; ++k) {
      term = term * twist / k;
      series += term;
    }
    ASSERT_LT((exp_se3(S).matrix() - series).cwiseAbs().maxCoeff(), 1e-12) << "S = " << S.transpose();
  }
}

TEST(ExpSe3, ReproducesPublishedTransforms) {
  // Translations that go with the exponential coordinates of dfki-ric/hand_embodiment's Mia and subject configurations.
  Vector6 mia;
  mia << -1.006, .865, -1.723, -.108, .088, .011;
  EXPECT_LT((exp_se3(mia).translation() - Eigen::Vector3d(-.00938, .11752, -.03176)).norm(), 2e-5);
  const Eigen::Quaterniond q(exp_se3(mia).linear());
  EXPECT_NEAR(std::abs(q.dot(Eigen::Quaterniond(-.464867, .409585, -.352178, .701505))), 1.0, 1e-6);
  Vector6 subject;
  subject << .1795496537, 1.6513870904, -.1843735310, -.0658988406, -.0238788252, .0873064542;
  EXPECT_LT((exp_se3(subject).translation() - Eigen::Vector3d(.01408, -.03172, .09495)).norm(), 1e-5);
}

TEST(Interpolate, IsALineWithConstantTurningSpeedBetweenItsEnds) {
  test::RandomValues random(5);
  for (int i = 0; i < 1'000; ++i) {
    const Pose X_WA = pose_from(random.vector<3>(-1.0, 1.0), random.rotation(3.0));
    const Pose X_WB = pose_from(random.vector<3>(-1.0, 1.0), random.rotation(3.0));
    const double s = random(0.0, 1.0);
    const Pose X = interpolate(X_WA, X_WB, s);
    const double whole = angle_between(X_WA.linear(), X_WB.linear());
    ASSERT_TRUE(is_valid(X));
    ASSERT_NEAR(angle_between(X_WA.linear(), X.linear()), s * whole, 1e-8);
    ASSERT_LT((X.translation() - (1.0 - s) * X_WA.translation() - s * X_WB.translation()).norm(), 1e-12);
    ASSERT_TRUE(interpolate(X_WA, X_WB, 0.0).isApprox(X_WA, 1e-12));
    ASSERT_TRUE(interpolate(X_WA, X_WB, 1.0).isApprox(X_WB, 1e-8));
  }
}

TEST(IsValid, RefusesWhatIsNoRigidMotion) {
  EXPECT_TRUE(is_valid(Pose::Identity()));
  Pose X = Pose::Identity();
  X.translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(is_valid(X));
  X = Pose::Identity();
  X.translation().y() = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(is_valid(X));
  X = Pose::Identity();
  X.linear() *= 1.001;
  EXPECT_FALSE(is_valid(X));
  X = Pose::Identity();
  X.linear().col(0) = -X.linear().col(0);  // a reflection
  EXPECT_FALSE(is_valid(X));
}

}  // namespace
}  // namespace embody::math
