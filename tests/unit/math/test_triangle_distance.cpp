#include "core/math/triangle_distance.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/math/pose.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::math {
namespace {

using Eigen::Vector3d;
using Triangle = std::array<Vector3d, 3>;

double distance(const Vector3d& p, const Triangle& t) {
  return distance_to_triangle(p, t[0], t[1], t[2]);
}

Vector3d nearest(const Vector3d& p, const Triangle& t) {
  return nearest_on_triangle(p, t[0], t[1], t[2]);
}

Triangle any_triangle(test::RandomValues& random) {
  return {random.vector<3>(-1.0, 1.0), random.vector<3>(-1.0, 1.0), random.vector<3>(-1.0, 1.0)};
}

double longest_side(const Triangle& t) {
  return std::max({(t[0] - t[1]).norm(), (t[1] - t[2]).norm(), (t[2] - t[0]).norm()});
}

/// Least distance to the points of a grid of n x n cells on the triangle.
double sampled_distance(const Vector3d& p, const Triangle& t, int n) {
  double least = (p - t[0]).norm();
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; i + j <= n; ++j) {
      const double v = static_cast<double>(i) / n, w = static_cast<double>(j) / n;
      least = std::min(least, (p - (t[0] + v * (t[1] - t[0]) + w * (t[2] - t[0]))).norm());
    }
  }
  return least;
}

/// Triangles of every kind: ordinary, needle, cap (a corner almost on the opposite edge), without area, a point.
Triangle any_kind(test::RandomValues& random, int kind) {
  Triangle t = any_triangle(random);
  const double thickness = std::pow(10.0, random(-16.0, -2.0));
  if (kind == 1) t[1] = t[0] + thickness * t[1];
  if (kind == 2) t[2] = t[0] + random(0.0, 1.0) * (t[1] - t[0]) + thickness * t[2];
  if (kind == 3) t[2] = t[0] + random(-1.0, 2.0) * (t[1] - t[0]);
  if (kind == 4) t[1] = t[2] = t[0];
  std::rotate(t.begin(), t.begin() + static_cast<int>(random(0.0, 3.0)), t.end());
  return t;
}

TEST(TriangleDistance, EqualsDenseSamplingOfTheTriangleWhateverItsShape) {
  test::RandomValues random(71);
  constexpr int kCells = 200;
  for (int i = 0; i < 1'500; ++i) {
    const Triangle t = any_kind(random, i % 5);
    const Vector3d p = random.vector<3>(-2.0, 2.0);
    const double sampled = sampled_distance(p, t, kCells);
    const double exact = distance(p, t);
    ASSERT_LE(exact, sampled + 1e-9) << "triangle " << i;
    // Any point of a cell is within one cell's side of a grid point.
    ASSERT_GE(exact, sampled - longest_side(t) / kCells) << "triangle " << i;
  }
}

TEST(TriangleDistance, IsExactInEachOfTheSevenRegions) {
  test::RandomValues random(72);
  std::array<int, 3> counts{};
  for (int i = 0; i < 3'000; ++i) {
    const Triangle t = any_triangle(random);
    const Vector3d n = (t[1] - t[0]).cross(t[2] - t[0]);
    if (n.norm() < 1e-3) continue;
    const Vector3d up = n.normalized();
    const double height = random(-1.0, 1.0), out = random(0.0, 1.0);
    // Face: straight above an inner point.
    const double v = random(0.0, 1.0), w = random(0.0, 1.0 - v);
    const Vector3d inner = t[0] + v * (t[1] - t[0]) + w * (t[2] - t[0]);
    ASSERT_NEAR(distance(inner + height * up, t), std::abs(height), 1e-12);
    ASSERT_LT((nearest(inner + height * up, t) - inner).norm(), 1e-11);
    ++counts[0];
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d &a = t[k], &b = t[(k + 1) % 3], &c = t[(k + 2) % 3];
      // Edge: beyond an inner point of the edge, in the plane that is normal to it.
      const Vector3d foot = a + random(0.0, 1.0) * (b - a);
      const Vector3d outward = (b - a).cross(up).normalized();
      ASSERT_NEAR(distance(foot + out * outward + height * up, t), std::hypot(out, height), 1e-12);
      ASSERT_LT((nearest(foot + out * outward + height * up, t) - foot).norm(), 1e-11);
      ++counts[1];
      // Corner: any direction that descends along neither edge (the corner's normal cone).
      const Vector3d d = random.vector<3>(-1.0, 1.0);
      if (d.dot(b - a) > 0.0 || d.dot(c - a) > 0.0) continue;
      ASSERT_NEAR(distance(a + d, t), d.norm(), 1e-12);
      ASSERT_EQ(nearest(a + d, t), a);
      ++counts[2];
    }
  }
  for (const int count : counts) EXPECT_GT(count, 1'000);
}

TEST(TriangleDistance, DoesNotDependOnTheOrderOfTheCorners) {
  test::RandomValues random(73);
  for (int i = 0; i < 5'000; ++i) {
    const Triangle t = any_kind(random, i % 5);
    const Vector3d p = random.vector<3>(-2.0, 2.0);
    const double d = distance(p, t);
    for (const Triangle& other : {Triangle{t[1], t[2], t[0]}, Triangle{t[2], t[0], t[1]}, Triangle{t[0], t[2], t[1]},
                                  Triangle{t[2], t[1], t[0]}, Triangle{t[1], t[0], t[2]}}) {
      ASSERT_NEAR(distance(p, other), d, 1e-9) << "triangle " << i;
    }
  }
}

TEST(TriangleDistance, MovesWithACommonMotionAndScalesWithTheScale) {
  test::RandomValues random(74);
  for (int i = 0; i < 5'000; ++i) {
    const Triangle t = any_triangle(random);
    const Vector3d p = random.vector<3>(-2.0, 2.0);
    const Pose X = pose_from(random.vector<3>(-1.0, 1.0), random.rotation(3.0));
    const double scale = std::pow(10.0, random(-4.0, 4.0));
    const auto moved = [&](const Vector3d& x) { return Vector3d(scale * (X * x)); };
    ASSERT_NEAR(distance(moved(p), {moved(t[0]), moved(t[1]), moved(t[2])}), scale * distance(p, t), 1e-9 * scale);
  }
}

TEST(TriangleDistance, IsMirroredByThePlaneOfTheTriangleAndNeverChangesFasterThanThePoint) {
  test::RandomValues random(75);
  for (int i = 0; i < 5'000; ++i) {
    const Triangle t = any_kind(random, i % 5);
    const Vector3d p = random.vector<3>(-2.0, 2.0), step = random.vector<3>(-0.1, 0.1);
    ASSERT_LE(std::abs(distance(p + step, t) - distance(p, t)), step.norm() + 1e-9);
    if (i % 5 != 0) continue;
    const Vector3d up = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
    ASSERT_NEAR(distance(p - 2.0 * up.dot(p - t[0]) * up, t), distance(p, t), 1e-9);
  }
}

TEST(TriangleDistance, OfATriangleWithoutAreaIsTheDistanceToItsLongestEdge) {
  test::RandomValues random(76);
  for (int i = 0; i < 5'000; ++i) {
    const Vector3d a = random.vector<3>(-1.0, 1.0), b = random.vector<3>(-1.0, 1.0), p = random.vector<3>(-2.0, 2.0);
    const double expected = (p - nearest_on_segment(p, a, b)).norm();
    ASSERT_NEAR(distance(p, {a, b, a + random(0.0, 1.0) * (b - a)}), expected, 1e-12);
    ASSERT_NEAR(distance(p, {a, a, b}), expected, 1e-12);
    ASSERT_EQ(distance(p, {a, a, a}), (p - a).norm());
    ASSERT_EQ(distance(a, {a, b, p}), 0.0);
  }
}

}  // namespace
}  // namespace embody::math
