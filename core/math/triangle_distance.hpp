#pragma once
// Distance from a point to a triangle: pure functions, no allocation, no exceptions.
#include <Eigen/Core>

namespace embody::math {

/// Point of the segment from `a` to `b` that is nearest to `p`; the segment may be a point.
[[nodiscard]] Eigen::Vector3d nearest_on_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                                 const Eigen::Vector3d& b) noexcept;

/// Point of the triangle `a`, `b`, `c` that is nearest to `p` (one of them where several are equally near).
///
/// The nearest point is in the interior or on an edge, hence seven cases: face, three edges, three corners (Ericson
/// 2004, Real-Time Collision Detection, section 5.1.5, decides between them one after the other). Here: seen along the
/// normal, `p` is inside, and the nearest point is its foot; or it is beyond one or two edges, and the nearest point is
/// on one of these. Every candidate belongs to the triangle, so rounding can only choose a slightly worse one, however
/// thin the triangle is; without area it is its edges. Some 50 ns.
[[nodiscard]] Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                                  const Eigen::Vector3d& b, const Eigen::Vector3d& c) noexcept;

/// |p - nearest_on_triangle(p, a, b, c)|, in the unit of the points.
[[nodiscard]] inline double distance_to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                                 const Eigen::Vector3d& b, const Eigen::Vector3d& c) noexcept {
  return (p - nearest_on_triangle(p, a, b, c)).norm();
}

}  // namespace embody::math
