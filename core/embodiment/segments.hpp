#pragma once
// Nearest points of two line segments.
#include <Eigen/Core>
#include <algorithm>

namespace embody {

struct NearestPoints {
  Eigen::Vector3d on_a{0.0, 0.0, 0.0};
  Eigen::Vector3d on_b{0.0, 0.0, 0.0};
};

/// Of the segments a0 a1 and b0 b1, degenerate ones included. The squared distance is convex in the two parameters
/// (s, t) of the unit square: its minimum is inside, or on one of the four edges. O(1), no heap.
[[nodiscard]] inline NearestPoints nearest_points(const Eigen::Vector3d& a0, const Eigen::Vector3d& a1,
                                                  const Eigen::Vector3d& b0, const Eigen::Vector3d& b1) noexcept {
  const Eigen::Vector3d u = a1 - a0, v = b1 - b0, w = a0 - b0;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v), uw = u.dot(w), vw = v.dot(w);
  const double determinant = uu * vv - uv * uv;
  const auto along = [](double numerator, double denominator) {
    return denominator > 1e-18 ? std::clamp(numerator / denominator, 0.0, 1.0) : 0.0;
  };
  double s = 0.0;
  if (determinant > 1e-14 * uu * vv) s = std::clamp((uv * vw - vv * uw) / determinant, 0.0, 1.0);
  double t = along(uv * s + vw, vv);
  s = along(uv * t - uw, uu);  // the best s for that t, and once more: alternating ends in the corner or on the edge
  t = along(uv * s + vw, vv);
  return {a0 + s * u, b0 + t * v};
}

}  // namespace embody
