#include "core/math/triangle_distance.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace embody::math {

using Eigen::Vector3d;

Vector3d nearest_on_segment(const Vector3d& p, const Vector3d& a, const Vector3d& b) noexcept {
  const Vector3d ab = b - a;
  const double length2 = ab.squaredNorm();
  if (!(length2 > 0.0)) return a;
  const double s = std::clamp(ab.dot(p - a) / length2, 0.0, 1.0);
  return s < 1.0 ? Vector3d(a + s * ab) : b;
}

Vector3d nearest_on_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) noexcept {
  const Vector3d ab = b - a, ac = c - a, ap = p - a;
  const Vector3d n = ab.cross(ac);
  // Barycentric coordinates of the foot of the perpendicular, times |n|^2: areas of the three parts of the triangle.
  const double area = n.squaredNorm();
  const double at_b = n.dot(ap.cross(ac));
  const double at_c = n.dot(ab.cross(ap));
  const double at_a = area - at_b - at_c;

  // Of a thin triangle the signs below mean nothing: then its edges compete, all of them, with the doubtful foot.
  constexpr double kThin = 1e-10;  // (sine of the corner at a)^2
  const bool thin = !(area > kThin * ab.squaredNorm() * ac.squaredNorm());

  Vector3d nearest = a;
  double least = ap.squaredNorm();
  const auto consider = [&](const Vector3d& q) {
    const double squared = (p - q).squaredNorm();
    if (squared < least) {
      least = squared;
      nearest = q;
    }
  };
  if (area > 0.0 && at_a >= 0.0 && at_b >= 0.0 && at_c >= 0.0) {
    consider(a + (at_b / area) * ab + (at_c / area) * ac);
  }
  if (thin || at_c < 0.0) consider(nearest_on_segment(p, a, b));
  if (thin || at_a < 0.0) consider(nearest_on_segment(p, b, c));
  if (thin || at_b < 0.0) consider(nearest_on_segment(p, c, a));
  return nearest;
}

}  // namespace embody::math
