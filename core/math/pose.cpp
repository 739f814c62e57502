#include "core/math/pose.hpp"

#include <algorithm>
#include <cmath>

namespace embody::math {
namespace {

Eigen::Matrix3d skew(const Eigen::Vector3d& w) noexcept {
  Eigen::Matrix3d S;
  S << 0.0, -w.z(), w.y(), w.z(), 0.0, -w.x(), -w.y(), w.x(), 0.0;
  return S;
}

}  // namespace

Eigen::Matrix3d exp_so3(const Eigen::Vector3d& w) noexcept {
  const double angle_2 = w.squaredNorm();
  const double angle = std::sqrt(angle_2);
  // sin(a)/a and (1-cos(a))/a^2 by Taylor series where the quotients lose digits.
  const double a = angle < 1e-4 ? 1.0 - angle_2 / 6.0 : std::sin(angle) / angle;
  const double b = angle < 1e-4 ? 0.5 - angle_2 / 24.0 : (1.0 - std::cos(angle)) / angle_2;
  const Eigen::Matrix3d W = skew(w);
  return Eigen::Matrix3d::Identity() + a * W + b * W * W;
}

Eigen::Vector3d log_so3(const Eigen::Matrix3d& R) noexcept {
  Eigen::Quaterniond q(R);
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  const double sin_half = q.vec().norm();
  if (sin_half < 1e-9) return 2.0 * q.vec();
  return (2.0 * std::atan2(sin_half, q.w()) / sin_half) * q.vec();
}

Pose exp_se3(const Vector6& S) noexcept {
  const Eigen::Vector3d w = S.head<3>();
  const double angle_2 = w.squaredNorm();
  const double angle = std::sqrt(angle_2);
  const double b = angle < 1e-4 ? 0.5 - angle_2 / 24.0 : (1.0 - std::cos(angle)) / angle_2;
  const double c = angle < 1e-4 ? 1.0 / 6.0 - angle_2 / 120.0 : (angle - std::sin(angle)) / (angle_2 * angle);
  const Eigen::Matrix3d W = skew(w);
  Pose X = Pose::Identity();
  X.linear() = exp_so3(w);
  X.translation() = (Eigen::Matrix3d::Identity() + b * W + c * W * W) * S.tail<3>();
  return X;
}

Pose pose_from(const Eigen::Vector3d& p, const Eigen::Vector3d& rotation_vector) noexcept {
  Pose X = Pose::Identity();
  X.linear() = exp_so3(rotation_vector);
  X.translation() = p;
  return X;
}

double angle_between(const Eigen::Matrix3d& R_WA, const Eigen::Matrix3d& R_WB) noexcept {
  return log_so3(R_WA.transpose() * R_WB).norm();
}

Pose interpolate(const Pose& X_WA, const Pose& X_WB, double s) noexcept {
  Pose X = Pose::Identity();
  X.linear() = X_WA.linear() * exp_so3(s * log_so3(X_WA.linear().transpose() * X_WB.linear()));
  X.translation() = X_WA.translation() + s * (X_WB.translation() - X_WA.translation());
  return X;
}

bool is_valid(const Pose& X) noexcept {
  const Eigen::Matrix3d R = X.linear();
  return X.matrix().allFinite() && (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-6 &&
         R.determinant() > 0.0;
}

}  // namespace embody::math
