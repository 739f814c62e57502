#include "core/hand/hand_model.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/math/random_values.hpp"

namespace embody::hand {
namespace {

using Eigen::Vector3d;

HandModel model_of(const HandData& data, const Shape& shape = Shape::Zero()) {
  return {data, shape, default_points(data)};
}

HandModel shaped(HandShape parameter, double value) {
  Shape shape = Shape::Zero();
  shape(static_cast<Eigen::Index>(parameter)) = value;
  return model_of(builtin_hand(Skeleton::kBoneLengths, Side::kRight), shape);
}

// A surface that no hand has: every vertex hangs on all joints and is corrected in every pose.
HandData wild_hand(Side side) {
  test::RandomValues random(40);
  HandData data = builtin_hand(Skeleton::kWebXr, Side::kRight);
  constexpr Eigen::Index kVertices = 40;
  HandMesh& mesh = data.mesh;
  mesh.vertices_M.resize(3, kVertices);
  mesh.shape_directions.resize(3 * kVertices, 10);
  mesh.pose_correctives.resize(3 * kVertices, kPoseCorrectives);
  mesh.weights.resize(kVertices, 16);
  for (double& x : mesh.vertices_M.reshaped()) x = random(-.1, .1);
  for (double& x : mesh.shape_directions.reshaped()) x = random(-.01, .01);
  for (double& x : mesh.pose_correctives.reshaped()) x = random(-.005, .005);
  for (double& x : mesh.weights.reshaped()) x = random(0.0, 1.0);
  for (Eigen::Index v = 0; v < kVertices; ++v) mesh.weights.row(v) /= mesh.weights.row(v).sum();
  mesh.triangles.resize(3, 0);
  return side == Side::kRight ? data : mirrored(data);
}

// Tip and middle, then a point of each other kind.
HandPoints points_of_every_kind(const HandData& data) {
  HandPoints points = default_points(data);
  for (std::size_t f = 0; f < kFingers; ++f) {
    const std::size_t first = first_joint(static_cast<Finger>(f));
    HandPoint point;
    for (std::size_t level = 0; level < 3; ++level) {
      point.kind = HandPoint::Kind::kJoint;
      point.joint = first + level;
      points[f].push_back(point);
    }
    point.kind = HandPoint::Kind::kTip;
    points[f].push_back(point);
    point.kind = HandPoint::Kind::kSurface;
    point.vertices = {static_cast<int>(3 * f), static_cast<int>(3 * f) + 1, static_cast<int>(3 * f) + 2};
    point.barycentric = {.2, .3, .5};
    point.offset_m = {.001, .007, -.002};
    points[f].push_back(point);
  }
  return points;
}

double length(const HandModel& model, Finger finger) {
  const std::size_t first = first_joint(finger);
  const auto& joints = model.rest_joints();
  return (joints[first + 1] - joints[first]).norm() + (joints[first + 2] - joints[first + 1]).norm() +
         (model.rest_tips()[static_cast<std::size_t>(finger)] - joints[first + 2]).norm();
}

class HandModelOfEachSkeleton : public testing::TestWithParam<Skeleton> {};
INSTANTIATE_TEST_SUITE_P(Skeletons, HandModelOfEachSkeleton, testing::Values(Skeleton::kBoneLengths, Skeleton::kWebXr));

TEST_P(HandModelOfEachSkeleton, IsAnAdultRightHandInManosFrame) {
  const HandModel model = model_of(builtin_hand(GetParam(), Side::kRight));
  const auto& joints = model.rest_joints();
  const auto& tips = model.rest_tips();
  EXPECT_LT((joints[0] - Vector3d(.0957, .0064, .0062)).norm(), 1e-12);
  EXPECT_NEAR((tips[2] - joints[0]).norm(), .1905, .001) << "hand length";
  for (const Vector3d& tip : tips) EXPECT_LT(tip.x(), joints[0].x()) << "fingers point to -x";
  EXPECT_GT(tips[0].z(), tips[1].z()) << "thumb on the +z side";
  for (std::size_t f = 1; f + 1 < kFingers; ++f) EXPECT_GT(tips[f].z(), tips[f + 1].z());
}

TEST_P(HandModelOfEachSkeleton, PutsTheMarkersOnTheBackOfTheFingers) {
  const HandModel model = model_of(builtin_hand(GetParam(), Side::kRight));
  for (std::size_t f = 0; f < kFingers; ++f) {
    const auto finger = static_cast<Finger>(f);
    const auto p_M = model.finger_points(finger, Vector9::Zero());
    const Vector3d& joint = model.rest_joints()[first_joint(finger) + model.joints_moving(finger, 1) - 1];
    EXPECT_LT((p_M[0] - model.rest_tips()[f]).norm(), .030) << kFingerNames[f] << " tip";
    EXPECT_LT((p_M[1] - joint).norm(), .050) << kFingerNames[f] << " middle";
    EXPECT_GT(p_M[1].y(), joint.y()) << kFingerNames[f] << " middle";
    EXPECT_GT(p_M[0].y(), model.rest_tips()[f].y() + .006) << kFingerNames[f] << " tip";
  }
}

class HandModelOfEachSide : public testing::TestWithParam<Side> {};
INSTANTIATE_TEST_SUITE_P(Sides, HandModelOfEachSide, testing::Values(Side::kRight, Side::kLeft));

TEST_P(HandModelOfEachSide, JacobiansEqualFiniteDifferencesForEveryKindOfPointAndEveryJoint) {
  const HandData data = wild_hand(GetParam());
  test::RandomValues random(41);
  const HandModel model(data, random.vector<10>(-.1, .1), points_of_every_kind(data));
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 300; ++i) {
    const auto finger = static_cast<Finger>(i % 5);
    const Vector9 q = (i < 5 ? 0.0 : 1.0) * random.vector<9>(-1.3, 1.3);
    const FingerChain at = model.chain(finger, q);
    for (Eigen::Index k = 0; k < 9; ++k) {
      const FingerChain ahead = model.chain(finger, q + kStep * Vector9::Unit(k));
      const FingerChain behind = model.chain(finger, q - kStep * Vector9::Unit(k));
      for (std::size_t point = 0; point < model.point_count(finger); ++point) {
        const Vector3d difference =
            (model.point(finger, point, ahead) - model.point(finger, point, behind)) / (2.0 * kStep);
        ASSERT_LT((model.jacobian(finger, point, at).col(k) - difference).norm(), 1e-9)
            << "point " << point << " q = " << q.transpose();
      }
    }
  }
}

TEST_P(HandModelOfEachSide, CurvatureEqualsFiniteDifferencesOfTheJacobians) {
  HandData data = wild_hand(GetParam());
  data.mesh.pose_correctives.resize(0, 0);  // curvature leaves them out
  test::RandomValues random(42);
  const HandModel model(data, random.vector<10>(-.1, .1), points_of_every_kind(data));
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 500; ++i) {
    const auto finger = static_cast<Finger>(i % 5);
    const Vector9 q = (i < 5 ? 0.0 : 1.0) * random.vector<9>(-1.3, 1.3);
    const auto point = static_cast<std::size_t>(i) % model.point_count(finger);
    const Vector3d c = random.vector<3>(-1.0, 1.0);
    Matrix9 curvature = Matrix9::Zero();
    model.add_curvature(finger, point, model.chain(finger, q), c, curvature);
    ASSERT_LT((curvature - curvature.transpose()).cwiseAbs().maxCoeff(), 1e-12);
    for (Eigen::Index k = 0; k < 9; ++k) {
      const PointJacobian ahead = model.jacobian(finger, point, model.chain(finger, q + kStep * Vector9::Unit(k)));
      const PointJacobian behind = model.jacobian(finger, point, model.chain(finger, q - kStep * Vector9::Unit(k)));
      const Vector9 difference = (ahead - behind).transpose() * c / (2.0 * kStep);
      ASSERT_LT((curvature.col(k) - difference).norm(), 1e-8) << "point " << point << " q = " << q.transpose();
    }
  }
}

TEST_P(HandModelOfEachSide, PointsOfABoneMoveWithTheJointThatCarriesThem) {
  const HandModel model = model_of(builtin_hand(Skeleton::kBoneLengths, GetParam()));
  test::RandomValues random(43);
  const auto rest = model.joint_poses(Vector48::Zero());
  for (int i = 0; i < 200; ++i) {
    Vector48 q = random.vector<48>(-1.0, 1.0);
    q.head<3>().setZero();
    const auto X_MJ = model.joint_poses(q);
    for (std::size_t f = 0; f < kFingers; ++f) {
      const auto finger = static_cast<Finger>(f);
      const Vector9 q_finger = q.segment<9>(static_cast<Eigen::Index>(3 + kFingerOffset[f]));
      for (std::size_t point = 0; point < 2; ++point) {
        const std::size_t joint = first_joint(finger) + model.joints_moving(finger, point) - 1;
        const Vector3d p_J = rest[joint].inverse() * model.finger_points(finger, Vector9::Zero())[point];
        ASSERT_LT((X_MJ[joint] * p_J - model.finger_points(finger, q_finger)[point]).norm(), 1e-12);
      }
    }
  }
}

TEST(HandModel, ALeftHandIsTheMirrorImageOfARightOne) {
  const HandData right_data = wild_hand(Side::kRight), left_data = mirrored(right_data);
  EXPECT_EQ(left_data.side, Side::kLeft);
  test::RandomValues random(45);
  const Shape shape = random.vector<10>(-.1, .1);
  HandPoints right_points = points_of_every_kind(right_data), left_points = points_of_every_kind(left_data);
  for (auto& finger : left_points) {
    finger[6].offset_m.x() = -finger[6].offset_m.x();
  }
  const HandModel right(right_data, shape, right_points), left(left_data, shape, left_points);
  for (int i = 0; i < 100; ++i) {
    const auto finger = static_cast<Finger>(i % 5);
    Vector9 q = random.vector<9>(-1.2, 1.2);
    const FingerChain at_right = right.chain(finger, q);
    mirror_angles(q);
    const FingerChain at_left = left.chain(finger, q);
    for (std::size_t point = 0; point < 7; ++point) {
      const Vector3d p = right.point(finger, point, at_right);
      ASSERT_LT((left.point(finger, point, at_left) - Vector3d(-p.x(), p.y(), p.z())).norm(), 1e-12) << point;
    }
  }
}

TEST(HandModel, MirroringTwiceChangesNothing) {
  const HandData data = wild_hand(Side::kRight), twice = mirrored(mirrored(data));
  EXPECT_EQ(twice.side, data.side);
  EXPECT_EQ(twice.joints_M, data.joints_M);
  EXPECT_EQ(twice.joint_directions, data.joint_directions);
  EXPECT_EQ(twice.mesh.vertices_M, data.mesh.vertices_M);
  EXPECT_EQ(twice.mesh.pose_correctives, data.mesh.pose_correctives);
}

TEST(HandModel, JointsAndPointsAreLinearInTheShape) {
  const HandData data = wild_hand(Side::kRight);
  test::RandomValues random(46);
  const HandPoints points = points_of_every_kind(data);
  const HandModel zero(data, Shape::Zero(), points);
  for (int i = 0; i < 50; ++i) {
    const Shape a = random.vector<10>(-.2, .2), b = random.vector<10>(-.2, .2);
    const HandModel at_a(data, a, points), at_b(data, b, points), at_sum(data, a + b, points);
    for (std::size_t k = 0; k < kHandModelJoints; ++k) {
      const Vector3d sum = at_a.rest_joints()[k] + at_b.rest_joints()[k] - zero.rest_joints()[k];
      ASSERT_LT((at_sum.rest_joints()[k] - sum).norm(), 1e-12) << k;
    }
    for (std::size_t f = 0; f < kFingers; ++f) {
      const auto finger = static_cast<Finger>(f);
      for (std::size_t point = 2; point < 7; ++point) {
        const auto at_rest = [&](const HandModel& m) {
          return m.point(finger, point, m.chain(finger, Vector9::Zero()));
        };
        ASSERT_LT((at_sum.point(finger, point, at_sum.chain(finger, Vector9::Zero())) - at_rest(at_a) - at_rest(at_b) +
                   at_rest(zero))
                      .norm(),
                  1e-12);
      }
    }
  }
}

TEST(HandModel, JointPosesFormManosTree) {
  const HandModel model;
  test::RandomValues random(44);
  const auto& rest = model.rest_joints();
  const Vector48 q = random.vector<48>(-1.0, 1.0);
  const auto X_MJ = model.joint_poses(q);
  for (std::size_t k = 1; k < kHandModelJoints; ++k) {
    const std::size_t parent = k % 3 == 1 ? 0 : k - 1;
    EXPECT_LT((X_MJ[parent].inverse() * X_MJ[k].translation() - (rest[k] - rest[parent])).norm(), 1e-12) << k;
    const Eigen::Matrix3d R = X_MJ[parent].linear().transpose() * X_MJ[k].linear();
    EXPECT_LT((math::log_so3(R) - q.segment<3>(static_cast<Eigen::Index>(3 * k))).norm(), 1e-9) << k;
  }
  EXPECT_LT((math::log_so3(X_MJ[0].linear()) - q.head<3>()).norm(), 1e-9) << "wrist";
}

TEST(HandModel, PositiveRotationAboutZFlexesTheFingers) {
  const HandModel model;
  for (std::size_t f = 1; f < kFingers; ++f) {
    Vector9 q = Vector9::Zero();
    q(2) = 0.5;
    const auto finger = static_cast<Finger>(f);
    EXPECT_LT(model.finger_points(finger, q)[0].y(), model.finger_points(finger, Vector9::Zero())[0].y() - .02);
  }
}

TEST(HandModelShape, ZeroIsTheReferenceAndScaleScalesEverythingAboutTheWrist) {
  const HandModel reference, big = shaped(HandShape::kScale, 0.1);
  const Vector3d wrist = reference.rest_joints()[0];
  EXPECT_EQ(big.rest_joints()[0], wrist);
  for (std::size_t f = 0; f < kFingers; ++f) {
    const auto finger = static_cast<Finger>(f);
    EXPECT_LT((big.rest_tips()[f] - wrist - 1.1 * (reference.rest_tips()[f] - wrist)).norm(), 1e-12);
    for (std::size_t point = 0; point < 2; ++point) {
      const Vector3d p = reference.finger_points(finger, Vector9::Zero())[point];
      EXPECT_LT((big.finger_points(finger, Vector9::Zero())[point] - wrist - 1.1 * (p - wrist)).norm(), 1e-12);
    }
  }
}

TEST(HandModelShape, EachFingerLengthChangesItsFingerOnly) {
  const HandModel reference;
  for (std::size_t f = 0; f < kFingers; ++f) {
    const auto parameter = static_cast<HandShape>(static_cast<std::size_t>(HandShape::kThumbLength) + f);
    const HandModel model = shaped(parameter, 0.2);
    for (std::size_t g = 0; g < kFingers; ++g) {
      const auto finger = static_cast<Finger>(g);
      const double factor = f == g ? 1.2 : 1.0;
      EXPECT_NEAR(length(model, finger), factor * length(reference, finger), 1e-12) << f << " " << g;
      EXPECT_EQ(model.rest_joints()[first_joint(finger)], reference.rest_joints()[first_joint(finger)]);
    }
  }
}

TEST(HandModelShape, PalmGirthAndDistalLengthChangeWhatTheirNamesSay) {
  const HandModel reference, broad = shaped(HandShape::kPalmBreadth, 0.1), deep = shaped(HandShape::kPalmLength, 0.1);
  const HandModel thick = shaped(HandShape::kGirth, 0.1), distal = shaped(HandShape::kDistalLength, 0.1);
  const auto& joints = reference.rest_joints();
  const auto breadth = [](const HandModel& m) { return m.rest_joints()[1].z() - m.rest_joints()[7].z(); };
  EXPECT_NEAR(breadth(broad), 1.1 * breadth(reference), 1e-12);
  EXPECT_NEAR(deep.rest_joints()[4].x() - joints[0].x(), 1.1 * (joints[4].x() - joints[0].x()), 1e-12);
  for (std::size_t f = 0; f < kFingers; ++f) {
    const auto finger = static_cast<Finger>(f);
    const std::size_t last = first_joint(finger) + 2;
    EXPECT_NEAR(length(broad, finger), length(reference, finger), 1e-12);
    EXPECT_NEAR(length(thick, finger), length(reference, finger), 1e-12);
    EXPECT_NEAR((distal.rest_tips()[f] - distal.rest_joints()[last]).norm(),
                1.1 * (reference.rest_tips()[f] - joints[last]).norm(), 1e-12);
    // The marker's distance from the bone grows with the girth.
    const Vector3d bone = (reference.rest_tips()[f] - joints[last]).normalized();
    const auto off_bone = [&](const HandModel& m) {
      const Vector3d p = m.finger_points(finger, Vector9::Zero())[0] - m.rest_joints()[last];
      return (p - p.dot(bone) * bone).norm();
    };
    EXPECT_NEAR(off_bone(thick), 1.1 * off_bone(reference), 1e-12);
  }
}

TEST(HandPoints, ThatAHandCannotHaveAreRefusedByName) {
  const HandData data = builtin_hand(Skeleton::kBoneLengths, Side::kRight);
  ASSERT_TRUE(check_points(data, default_points(data)));
  HandPoints points = default_points(data);
  points[1][0].joint = 99;
  EXPECT_NE(check_points(data, points).error().detail.view().find("point 0 of the index finger: joint 99"),
            std::string_view::npos);
  points = default_points(data);
  points[4][1].offset_m.y() = std::nan("");
  EXPECT_NE(check_points(data, points).error().detail.view().find("point 1 of the little finger"),
            std::string_view::npos);
  points = default_points(data);
  points[2][0].kind = HandPoint::Kind::kSurface;
  points[2][0].vertices.fill(static_cast<int>(data.mesh.size()));
  EXPECT_NE(check_points(data, points).error().detail.view().find("no vertex"), std::string_view::npos);
}

}  // namespace
}  // namespace embody::hand
