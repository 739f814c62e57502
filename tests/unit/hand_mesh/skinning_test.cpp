#include "core/hand/skinning.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/hand/hand_model.hpp"
#include "core/math/pose.hpp"
#include "tests/support/heap_counter.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::hand {
namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

/// The built-in hand with correctives, all of them different: what no hand has and no formula may mix up.
HandData corrected_hand(Side side) {
  test::RandomValues random(21);
  HandData data = builtin_hand(Skeleton::kWebXr, Side::kRight);
  data.mesh.pose_correctives.resize(3 * data.mesh.size(), kPoseCorrectives);
  for (double& x : data.mesh.pose_correctives.reshaped()) x = random(-.003, .003);
  return side == Side::kRight ? data : mirrored(data);
}

double largest_distance(const Matrix3Xd& a, const Matrix3Xd& b) {
  return (a - b).colwise().norm().maxCoeff();
}

Matrix3Xd flipped(Matrix3Xd points) {
  points.row(0) *= -1.0;
  return points;
}

class HandSkinOf : public testing::TestWithParam<std::pair<const char*, HandData>> {
 protected:
  const HandData& data = GetParam().second;
};
INSTANTIATE_TEST_SUITE_P(Hands, HandSkinOf,
                         testing::Values(std::pair{"Builtin", builtin_hand(Skeleton::kBoneLengths, Side::kRight)},
                                         std::pair{"BuiltinLeft", builtin_hand(Skeleton::kWebXr, Side::kLeft)},
                                         std::pair{"Corrected", corrected_hand(Side::kRight)},
                                         std::pair{"CorrectedLeft", corrected_hand(Side::kLeft)}),
                         [](const auto& hand) { return hand.param.first; });

TEST_P(HandSkinOf, IsTheTemplateInTheFlatHandOfZeroShape) {
  HandSkin skin(data, Shape::Zero());
  EXPECT_LT(largest_distance(skin.vertices(), data.mesh.vertices_M), 1e-15);
  skin.step(Vector48::Constant(.4));
  EXPECT_GT(largest_distance(skin.vertices(), data.mesh.vertices_M), .01);
  skin.step(Vector48::Zero());
  EXPECT_LT(largest_distance(skin.vertices(), data.mesh.vertices_M), 1e-15);
}

TEST_P(HandSkinOf, IsLinearInTheShapeOfTheFlatHand) {
  test::RandomValues random(22);
  const auto a = random.vector<10>(-.1, .1), b = random.vector<10>(-.1, .1);
  const Matrix3Xd& zero = data.mesh.vertices_M;
  const Matrix3Xd sum = HandSkin(data, Shape(a + 2.0 * b)).vertices() - zero;
  const Matrix3Xd parts = (HandSkin(data, a).vertices() - zero) + 2.0 * (HandSkin(data, b).vertices() - zero);
  EXPECT_LT(largest_distance(sum, parts), 1e-14);
  EXPECT_GT(sum.colwise().norm().maxCoeff(), .001);
}

TEST_P(HandSkinOf, TurnsRigidlyAboutTheWristWithTheRootRotation) {
  test::RandomValues random(23);
  for (int trial = 0; trial < 20; ++trial) {
    const auto shape = random.vector<10>(-.1, .1);
    HandSkin skin(data, shape);
    Vector48 q = random.vector<48>(-.5, .5);
    q.head<3>().setZero();
    skin.step(q);
    const Matrix3Xd before = skin.vertices();
    const auto w = random.vector<3>(-2.0, 2.0);
    q.head<3>() = w;
    skin.step(q);
    const Vector3d wrist = data.joints_M.col(0) + data.joint_directions.topRows<3>() * shape;
    const Matrix3Xd turned = (math::exp_so3(w) * (before.colwise() - wrist)).colwise() + wrist;
    ASSERT_LT(largest_distance(skin.vertices(), turned), 1e-13) << "trial " << trial;
  }
}

TEST_P(HandSkinOf, AgreesWithTheHandModelAtEveryPointOfTheSurface) {
  test::RandomValues random(24);
  for (int trial = 0; trial < 20; ++trial) {
    const auto shape = random.vector<10>(-.1, .1);
    HandSkin skin(data, shape);
    HandPoints points;
    for (std::size_t f = 0; f < kFingers; ++f) {
      while (points[f].size() < kMaxFingerPoints) {
        HandPoint point;
        point.kind = HandPoint::Kind::kSurface;
        point.vertices.fill(static_cast<int>(random(0.0, static_cast<double>(data.mesh.size()) - .01)));
        points[f].push_back(point);
      }
    }
    ASSERT_TRUE(check_points(data, points));
    const HandModel model(data, shape, points);
    for (std::size_t f = 0; f < kFingers; ++f) {  // the model moves one finger at a time
      const auto finger = static_cast<Finger>(f);
      const auto q = random.vector<9>(-1.0, 1.0);
      Vector48 all = Vector48::Zero();
      all.segment<9>(3 * static_cast<Index>(first_joint(finger))) = q;
      skin.step(all);
      for (std::size_t i = 0; i < kMaxFingerPoints; ++i) {
        const int v = points[f][i].vertices[0];
        ASSERT_LT((model.point(finger, i, model.chain(finger, q)) - skin.vertices().col(v)).norm(), 1e-13)
            << kFingerNames[f] << " vertex " << v << " trial " << trial;
      }
    }
  }
}

TEST_P(HandSkinOf, MirrorsWithEveryJoint) {
  test::RandomValues random(25);
  const HandData other = mirrored(data);
  const auto shape = random.vector<10>(-.1, .1);
  HandSkin skin(data, shape), mirror(other, shape);
  for (Index joint = 0; joint < 16; ++joint) {
    Vector48 q = Vector48::Zero();
    q.segment<3>(3 * joint) = random.vector<3>(-1.5, 1.5);
    skin.step(q);
    skin.update_normals();
    mirror_angles(q);
    mirror.step(q);
    mirror.update_normals();
    ASSERT_LT(largest_distance(flipped(skin.vertices()), mirror.vertices()), 1e-14) << "joint " << joint;
    ASSERT_LT(largest_distance(flipped(skin.normals()), mirror.normals()), 1e-9) << "joint " << joint;
  }
}

TEST_P(HandSkinOf, GivesTheContactPointsOfThePresentPose) {
  test::RandomValues random(26);
  HandSkin skin(data, Shape::Zero());
  skin.step(random.vector<48>(-.6, .6));
  for (std::size_t f = 0; f < kFingers; ++f) {
    const auto& patch = data.mesh.contact_vertices[f];
    const Matrix3Xd& points = skin.contact_points(static_cast<Finger>(f));
    ASSERT_EQ(points.cols(), static_cast<Index>(patch.size()));
    for (std::size_t i = 0; i < patch.size(); ++i) {
      ASSERT_EQ((points.col(static_cast<Index>(i)) - skin.vertices().col(patch[i])).norm(), 0.0);
    }
  }
}

TEST_P(HandSkinOf, HasUnitNormals) {
  test::RandomValues random(27);
  HandSkin skin(data, Shape::Zero());
  skin.step(random.vector<48>(-.4, .4));
  skin.update_normals();
  EXPECT_LT((skin.normals().colwise().norm().array() - 1.0).abs().maxCoeff(), 1e-12);
}

TEST_P(HandSkinOf, TakesNoHeapInAStep) {
  if (!test::counts_heap()) GTEST_SKIP() << "a sanitizer owns malloc";
  test::RandomValues random(28);
  HandSkin skin(data, Shape::Zero());
  const auto q = random.vector<48>(-.4, .4);
  const std::uint64_t before = test::heap_allocations();
  skin.step(q);
  skin.update_normals();
  EXPECT_EQ(test::heap_allocations(), before);
}

TEST(HandSkinNormals, PointAwayFromTheBonesOfTheBuiltinHand) {
  const HandData data = builtin_hand(Skeleton::kBoneLengths, Side::kRight);
  const HandSkin skin(data, Shape::Zero());
  for (const int v : data.mesh.contact_vertices[static_cast<std::size_t>(Finger::kMiddle)]) {
    EXPECT_LT(skin.normals()(1, v), -.4) << "vertex " << v;
  }
}

TEST(HandSkinOfNothing, IsEmpty) {
  HandData data = builtin_hand(Skeleton::kBoneLengths, Side::kRight);
  data.mesh = HandMesh{};
  HandSkin skin(data, Shape::Zero());
  skin.step(Vector48::Constant(.2));
  skin.update_normals();
  EXPECT_EQ(skin.vertices().cols(), 0);
}

}  // namespace
}  // namespace embody::hand
