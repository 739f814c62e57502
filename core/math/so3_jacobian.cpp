#include "core/math/so3_jacobian.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace embody::math {
namespace {

// J_l = I + b [w]x + c [w]x^2 with b = (1 - cos t)/t^2 and c = (t - sin t)/t^3, t = |w|; b1 = (db/dt)/t, c1 =
// (dc/dt)/t.
struct Coefficients {
  double b, c, b1, c1;
};

Coefficients coefficients(double t2) noexcept {
  if (t2 < 2.5e-3) {  // Taylor series: the quotients lose digits
    return {0.5 - t2 * (1.0 / 24.0 - t2 / 720.0), 1.0 / 6.0 - t2 * (1.0 / 120.0 - t2 / 5040.0),
            -1.0 / 12.0 + t2 * (1.0 / 180.0 - t2 / 6720.0), -1.0 / 60.0 + t2 * (1.0 / 1260.0 - t2 / 60480.0)};
  }
  const double t = std::sqrt(t2);
  const double sine = std::sin(t);
  const double cosine = std::cos(t);
  return {(1.0 - cosine) / t2, (t - sine) / (t2 * t), (t * sine - 2.0 * (1.0 - cosine)) / (t2 * t2),
          (3.0 * sine - 2.0 * t - t * cosine) / (t2 * t2 * t)};
}

Eigen::Matrix3d skew(const Eigen::Vector3d& w) noexcept {
  Eigen::Matrix3d S;
  S << 0.0, -w.z(), w.y(), w.z(), 0.0, -w.x(), -w.y(), w.x(), 0.0;
  return S;
}

}  // namespace

Eigen::Matrix3d left_jacobian_so3(const Eigen::Vector3d& w) noexcept {
  const double t2 = w.squaredNorm();
  const Coefficients k = coefficients(t2);
  Eigen::Matrix3d J = k.b * skew(w) + k.c * w * w.transpose();
  J.diagonal().array() += 1.0 - k.c * t2;
  return J;
}

Eigen::Matrix3d left_jacobian_derivative_so3(const Eigen::Vector3d& w, const Eigen::Vector3d& m) noexcept {
  // m^T J_l = m + b (m x w) + c ((m.w) w - t^2 m), differentiated term by term.
  const double t2 = w.squaredNorm();
  const Coefficients k = coefficients(t2);
  const double mw = m.dot(w);
  const Eigen::Vector3d outer = k.b1 * m.cross(w) + k.c1 * (mw * w - t2 * m);
  Eigen::Matrix3d D = k.b * skew(m) + k.c * (w * m.transpose() - 2.0 * m * w.transpose()) + outer * w.transpose();
  D.diagonal().array() += k.c * mw;
  return D;
}

}  // namespace embody::math
