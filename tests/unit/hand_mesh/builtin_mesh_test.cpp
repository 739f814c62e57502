#include "core/hand/builtin_mesh.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>
#include <numeric>
#include <set>

#include "core/hand/skinning.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::hand {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr Index kWrist = 0;

struct Case {
  Skeleton skeleton;
  Side side;
};

class BuiltinMesh : public testing::TestWithParam<Case> {
 protected:
  const HandData data = builtin_hand(GetParam().skeleton, GetParam().side);
  const HandMesh& mesh = data.mesh;

  /// The finger that a vertex hangs on; kFingers: the palm's.
  [[nodiscard]] std::size_t finger_of(Index v) const {
    for (std::size_t f = 0; f < kFingers; ++f) {
      const auto first = static_cast<Index>(first_joint(static_cast<Finger>(f)));
      if (mesh.weights.row(v).segment<3>(first).sum() > 0.0) return f;
    }
    return kFingers;
  }
  [[nodiscard]] std::array<Vector3d, 4> bones(std::size_t f, const Shape& shape) const {
    std::array<Vector3d, 4> points;
    for (std::size_t level = 0; level < 3; ++level) {
      const auto k = static_cast<Index>(first_joint(static_cast<Finger>(f)) + level);
      points[level] = data.joints_M.col(k) + data.joint_directions.middleRows<3>(3 * k) * shape;
    }
    const auto tip = static_cast<Index>(f);
    points[3] = data.tips_M.col(tip) + data.tip_directions.middleRows<3>(3 * tip) * shape;
    return points;
  }
};
INSTANTIATE_TEST_SUITE_P(Hands, BuiltinMesh,
                         testing::Values(Case{Skeleton::kBoneLengths, Side::kRight},
                                         Case{Skeleton::kBoneLengths, Side::kLeft},
                                         Case{Skeleton::kWebXr, Side::kRight}, Case{Skeleton::kWebXr, Side::kLeft}));

double distance_to_segment(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d along = b - a;
  return (p - a - std::clamp((p - a).dot(along) / along.squaredNorm(), 0.0, 1.0) * along).norm();
}

/// Component of each vertex: the smallest vertex that is connected to it.
std::vector<int> components(const HandMesh& mesh) {
  std::vector<int> root(static_cast<std::size_t>(mesh.size()));
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&root](int v) {
    while (root[static_cast<std::size_t>(v)] != v) v = root[static_cast<std::size_t>(v)];
    return v;
  };
  for (Index t = 0; t < mesh.triangles.cols(); ++t) {
    for (Index corner = 1; corner < 3; ++corner) {
      const int a = find(mesh.triangles(0, t)), b = find(mesh.triangles(corner, t));
      root[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  }
  for (int& v : root) v = find(v);
  return root;
}

TEST_P(BuiltinMesh, HasAboutAThousandFiniteVertices) {
  EXPECT_GE(mesh.size(), 600);
  EXPECT_LE(mesh.size(), 1500);
  EXPECT_TRUE(mesh.vertices_M.allFinite());
  EXPECT_TRUE(mesh.shape_directions.allFinite());
  EXPECT_EQ(mesh.shape_directions.rows(), 3 * mesh.size());
  EXPECT_EQ(mesh.shape_directions.cols(), 10);
  EXPECT_EQ(mesh.pose_correctives.size(), 0);
  EXPECT_EQ(mesh.weights.rows(), mesh.size());
  EXPECT_EQ(mesh.weights.cols(), 16);
  EXPECT_GE(mesh.triangles.minCoeff(), 0);
  EXPECT_LT(mesh.triangles.maxCoeff(), mesh.size());
}

TEST_P(BuiltinMesh, IsSixClosedSurfacesOfGenusZero) {
  std::map<std::pair<int, int>, int> directed;
  for (Index t = 0; t < mesh.triangles.cols(); ++t) {
    for (Index corner = 0; corner < 3; ++corner) {
      ++directed[{mesh.triangles(corner, t), mesh.triangles((corner + 1) % 3, t)}];
    }
  }
  for (const auto& [edge, count] : directed) {
    ASSERT_EQ(count, 1) << "edge " << edge.first << " - " << edge.second;
    ASSERT_TRUE(directed.count({edge.second, edge.first})) << "open edge " << edge.first << " - " << edge.second;
  }
  const auto component = components(mesh);
  std::map<int, int> euler;  // V - E + F
  for (const int c : component) ++euler[c];
  for (const auto& [edge, count] : directed) {
    if (edge.first < edge.second) --euler[component[static_cast<std::size_t>(edge.first)]];
  }
  for (Index t = 0; t < mesh.triangles.cols(); ++t) ++euler[component[static_cast<std::size_t>(mesh.triangles(0, t))]];
  EXPECT_EQ(euler.size(), 6U);
  for (const auto& [first, characteristic] : euler) EXPECT_EQ(characteristic, 2) << "part of vertex " << first;
}

TEST_P(BuiltinMesh, FacesOutwardsAndHasTheVolumeOfAHand) {
  const auto component = components(mesh);
  std::map<int, double> volume;
  for (Index t = 0; t < mesh.triangles.cols(); ++t) {
    const Vector3d a = mesh.vertices_M.col(mesh.triangles(0, t)), b = mesh.vertices_M.col(mesh.triangles(1, t)),
                   c = mesh.vertices_M.col(mesh.triangles(2, t));
    volume[component[static_cast<std::size_t>(mesh.triangles(0, t))]] += a.dot(b.cross(c)) / 6.0;
  }
  double sum = 0.0;
  for (const auto& [first, part] : volume) {
    EXPECT_GT(part, 5e-6) << "part of vertex " << first;
    sum += part;
  }
  EXPECT_GT(sum, 250e-6);
  EXPECT_LT(sum, 500e-6);
  // No triangle is folded inwards: each one of a finger faces away from the finger's bones.
  for (Index t = 0; t < mesh.triangles.cols(); ++t) {
    const std::size_t f = finger_of(mesh.triangles(0, t));
    if (f == kFingers) continue;
    const Vector3d a = mesh.vertices_M.col(mesh.triangles(0, t)), b = mesh.vertices_M.col(mesh.triangles(1, t)),
                   c = mesh.vertices_M.col(mesh.triangles(2, t));
    const Vector3d n = (b - a).cross(c - a).normalized();
    const auto bone = bones(f, Shape::Zero());
    const Vector3d centre = (a + b + c) / 3.0;
    double nearest = 1.0;
    Vector3d out = Vector3d::Zero();
    for (std::size_t level = 0; level < 3; ++level) {
      const Vector3d along = bone[level + 1] - bone[level];
      const Vector3d at =
          bone[level] + std::clamp((centre - bone[level]).dot(along) / along.squaredNorm(), 0.0, 1.0) * along;
      if ((centre - at).norm() < nearest) {
        nearest = (centre - at).norm();
        out = centre - at;
      }
    }
    EXPECT_GT(n.dot(out), 0.0) << "triangle " << t;
  }
}

TEST_P(BuiltinMesh, HangsOnTheFingersOwnJointsAndTheWristWithWeightsThatSumToOne) {
  for (Index v = 0; v < mesh.size(); ++v) {
    ASSERT_NEAR(mesh.weights.row(v).sum(), 1.0, 1e-12);
    ASSERT_GE(mesh.weights.row(v).minCoeff(), 0.0);
    ASSERT_LE((mesh.weights.row(v).array() > 0.0).count(), 4);
    const std::size_t f = finger_of(v);
    if (f == kFingers) {
      ASSERT_EQ(mesh.weights(v, kWrist), 1.0);
      continue;
    }
    const auto first = static_cast<Index>(first_joint(static_cast<Finger>(f)));
    ASSERT_NEAR(mesh.weights(v, kWrist) + mesh.weights.row(v).segment<3>(first).sum(), 1.0, 1e-12);
  }
}

TEST_P(BuiltinMesh, WeightsChangeLittleFromVertexToVertex) {
  for (Index t = 0; t < mesh.triangles.cols(); ++t) {
    const auto a = mesh.weights.row(mesh.triangles(0, t)), b = mesh.weights.row(mesh.triangles(1, t));
    ASSERT_LE((a - b).cwiseAbs().maxCoeff(), .75) << "triangle " << t;
  }
}

TEST_P(BuiltinMesh, StaysWithinAFingersThicknessOfItsBonesForEveryShape) {
  constexpr std::array kThickest_m{.0190, .0110, .0111, .0097, .0087};
  test::RandomValues random(11);
  for (int trial = 0; trial < 20; ++trial) {
    Shape shape;
    for (double& s : shape) s = trial == 0 ? 0.0 : random(-.1, .1);
    const double growth = 1.0 + data.thickness_directions.dot(shape);
    const Eigen::VectorXd moved = mesh.vertices_M.reshaped() + mesh.shape_directions * shape;
    for (Index v = 0; v < mesh.size(); ++v) {
      const std::size_t f = finger_of(v);
      if (f == kFingers || mesh.weights(v, kWrist) > 0.0) continue;  // rounded roots lie behind the first joint
      const auto bone = bones(f, shape);
      const Vector3d p = moved.segment<3>(3 * v);
      double nearest = 1.0;
      for (std::size_t level = 0; level < 3; ++level) {
        nearest = std::min(nearest, distance_to_segment(p, bone[level], bone[level + 1]));
      }
      ASSERT_LE(nearest, kThickest_m[f] * growth + 1e-9) << "vertex " << v << " trial " << trial;
    }
  }
}

TEST_P(BuiltinMesh, EndsExactlyAtTheFleshyTipsForEveryShape) {
  test::RandomValues random(12);
  for (int trial = 0; trial < 20; ++trial) {
    Shape shape;
    for (double& s : shape) s = random(-.1, .1);
    const Eigen::VectorXd moved = mesh.vertices_M.reshaped() + mesh.shape_directions * shape;
    for (std::size_t f = 0; f < kFingers; ++f) {
      const auto bone = bones(f, shape);
      const Vector3d along = (bone[3] - bone[2]).normalized();
      double farthest = -1.0;
      for (Index v = 0; v < mesh.size(); ++v) {
        if (finger_of(v) == f) farthest = std::max(farthest, (Vector3d(moved.segment<3>(3 * v)) - bone[3]).dot(along));
      }
      ASSERT_NEAR(farthest, 0.0, 1e-12) << kFingerNames[f];
    }
  }
}

TEST_P(BuiltinMesh, GirthChangesTheDistanceFromTheBonesAndLengthsDoNot) {
  const auto moved = [&](HandShape parameter, double value) -> Eigen::VectorXd {
    Shape shape = Shape::Zero();
    shape(static_cast<Index>(parameter)) = value;
    return mesh.vertices_M.reshaped() + mesh.shape_directions * shape;
  };
  Shape girth = Shape::Zero();
  girth(static_cast<Index>(HandShape::kGirth)) = .1;
  Shape length = Shape::Zero();
  length(static_cast<Index>(HandShape::kIndexLength)) = .1;
  const auto thick = moved(HandShape::kGirth, .1), longer = moved(HandShape::kIndexLength, .1);
  const auto f = static_cast<std::size_t>(Finger::kIndex);
  const auto radius = [](const Vector3d& p, const std::array<Vector3d, 4>& bone) {
    double nearest = 1.0;
    for (std::size_t level = 0; level < 3; ++level)
      nearest = std::min(nearest, distance_to_segment(p, bone[level], bone[level + 1]));
    return nearest;
  };
  int checked = 0;
  for (Index v = 0; v < mesh.size(); ++v) {
    const auto first = static_cast<Index>(first_joint(Finger::kIndex));
    if (mesh.weights(v, first) < .999) continue;  // in the middle of the first phalanx
    const Vector3d p = mesh.vertices_M.col(v);
    const double rest = radius(p, bones(f, Shape::Zero()));
    EXPECT_NEAR(radius(thick.segment<3>(3 * v), bones(f, girth)), 1.1 * rest, 1e-9);
    EXPECT_NEAR(radius(longer.segment<3>(3 * v), bones(f, length)), rest, 1e-9);
    ++checked;
  }
  EXPECT_GE(checked, 12);
}

TEST_P(BuiltinMesh, ScaleIsASimilarityAboutTheWrist) {
  Shape shape = Shape::Zero();
  shape(static_cast<Index>(HandShape::kScale)) = .07;
  const Eigen::VectorXd moved = mesh.vertices_M.reshaped() + mesh.shape_directions * shape;
  const Vector3d wrist = data.joints_M.col(0);
  for (Index v = 0; v < mesh.size(); ++v) {
    const Vector3d expected = wrist + 1.07 * (mesh.vertices_M.col(v) - wrist);
    ASSERT_LT((Vector3d(moved.segment<3>(3 * v)) - expected).norm(), 1e-12) << "vertex " << v;
  }
}

TEST_P(BuiltinMesh, HasTheBoundingBoxOfAHand) {
  const Vector3d size = mesh.vertices_M.rowwise().maxCoeff() - mesh.vertices_M.rowwise().minCoeff();
  EXPECT_GT(size.x(), .185);  // hand length 190 mm and a piece of wrist
  EXPECT_LT(size.x(), .215);
  EXPECT_GT(size.y(), .030);
  EXPECT_LT(size.y(), .080);
  EXPECT_GT(size.z(), .120);  // little finger to thumb
  EXPECT_LT(size.z(), .180);
}

TEST_P(BuiltinMesh, ContactPatchesAreTheInnerSideOfTheLastTwoPhalanges) {
  std::set<int> seen;
  for (std::size_t f = 0; f < kFingers; ++f) {
    const auto& patch = mesh.contact_vertices[f];
    EXPECT_GE(patch.size(), 15U) << kFingerNames[f];
    const auto bone = bones(f, Shape::Zero());
    double most_distal = 0.0, most_proximal = 1.0;
    for (const int v : patch) {
      EXPECT_TRUE(seen.insert(v).second) << "vertex " << v << " belongs to two patches";
      const Vector3d p = mesh.vertices_M.col(v);
      const std::size_t level =
          distance_to_segment(p, bone[1], bone[2]) < distance_to_segment(p, bone[2], bone[3]) ? 1 : 2;
      const Vector3d along = (bone[level + 1] - bone[level]).normalized();
      const Vector3d out = p - bone[level] - (p - bone[level]).dot(along) * along;
      if (f == static_cast<std::size_t>(Finger::kThumb)) {
        EXPECT_LT(out.dot(dorsal_direction(Finger::kThumb)), 0.0) << "thumb vertex " << v;
      } else {
        EXPECT_LT(out.y(), 0.0) << kFingerNames[f] << " vertex " << v;
      }
      const double x = (p - bone[1]).dot((bone[3] - bone[1]).normalized()) / (bone[3] - bone[1]).norm();
      most_distal = std::max(most_distal, x);
      most_proximal = std::min(most_proximal, x);
    }
    EXPECT_GT(most_distal, .85) << kFingerNames[f];
    EXPECT_LT(most_proximal, .20) << kFingerNames[f];
    EXPECT_GT(most_proximal, -.05) << kFingerNames[f];
  }
}

TEST(BuiltinMeshSides, AreMirrorImages) {
  const HandMesh right = builtin_hand(Skeleton::kBoneLengths, Side::kRight).mesh;
  const HandMesh left = builtin_hand(Skeleton::kBoneLengths, Side::kLeft).mesh;
  ASSERT_EQ(left.size(), right.size());
  Eigen::Matrix3Xd flipped = right.vertices_M;
  flipped.row(0) *= -1.0;
  EXPECT_EQ((left.vertices_M - flipped).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_EQ(left.contact_vertices, right.contact_vertices);
}

}  // namespace
}  // namespace embody::hand
