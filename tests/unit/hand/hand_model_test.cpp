#include "core/hand/hand_model.hpp"

#include <gtest/gtest.h>

#include "tests/unit/math/random_values.hpp"

namespace embody::hand {
namespace {

using Eigen::Vector3d;

HandModel model_of(Skeleton skeleton) {
  HandModelConfig config;
  config.skeleton = skeleton;
  config.attachments = default_attachments(skeleton);
  return HandModel(config);
}

HandModel shaped(HandShape parameter, double value) {
  HandModelConfig config;
  config.shape(static_cast<Eigen::Index>(parameter)) = value;
  return HandModel(config);
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
  const HandModel model = model_of(GetParam());
  const auto& joints = model.rest_joints();
  const auto& tips = model.rest_tips();
  EXPECT_LT((joints[0] - Vector3d(.0957, .0064, .0062)).norm(), 1e-12);
  EXPECT_NEAR((tips[2] - joints[0]).norm(), .1905, .001) << "hand length";
  for (const Vector3d& tip : tips) EXPECT_LT(tip.x(), joints[0].x()) << "fingers point to -x";
  EXPECT_GT(tips[0].z(), tips[1].z()) << "thumb on the +z side";
  for (std::size_t f = 1; f + 1 < kFingers; ++f) EXPECT_GT(tips[f].z(), tips[f + 1].z());
}

TEST_P(HandModelOfEachSkeleton, PutsTheMarkersOnTheBackOfTheFingers) {
  const HandModel model = model_of(GetParam());
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

TEST_P(HandModelOfEachSkeleton, JacobiansEqualFiniteDifferences) {
  const HandModel model = model_of(GetParam());
  test::RandomValues random(41);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 500; ++i) {
    const auto finger = static_cast<Finger>(i % 5);
    const Vector9 q = (i < 5 ? 0.0 : 1.0) * random.vector<9>(-1.3, 1.3);
    const FingerKinematics at = model.finger_kinematics(finger, q);
    for (Eigen::Index k = 0; k < 9; ++k) {
      const auto ahead = model.finger_points(finger, q + kStep * Vector9::Unit(k));
      const auto behind = model.finger_points(finger, q - kStep * Vector9::Unit(k));
      for (std::size_t point = 0; point < 2; ++point) {
        const Vector3d difference = (ahead[point] - behind[point]) / (2.0 * kStep);
        ASSERT_LT((at.J[point].col(k) - difference).norm(), 1e-9) << "q = " << q.transpose();
      }
    }
  }
}

TEST_P(HandModelOfEachSkeleton, CurvatureEqualsFiniteDifferencesOfTheJacobians) {
  const HandModel model = model_of(GetParam());
  test::RandomValues random(42);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 500; ++i) {
    const auto finger = static_cast<Finger>(i % 5);
    const Vector9 q = (i < 5 ? 0.0 : 1.0) * random.vector<9>(-1.3, 1.3);
    const std::size_t point = i % 2;
    const Vector3d c = random.vector<3>(-1.0, 1.0);
    Matrix9 curvature = Matrix9::Zero();
    add_curvature(model.finger_kinematics(finger, q), point, c, curvature);
    ASSERT_LT((curvature - curvature.transpose()).cwiseAbs().maxCoeff(), 1e-12);
    for (Eigen::Index k = 0; k < 9; ++k) {
      const PointJacobian ahead = model.finger_kinematics(finger, q + kStep * Vector9::Unit(k)).J[point];
      const PointJacobian behind = model.finger_kinematics(finger, q - kStep * Vector9::Unit(k)).J[point];
      const Vector9 difference = (ahead - behind).transpose() * c / (2.0 * kStep);
      ASSERT_LT((curvature.col(k) - difference).norm(), 1e-8) << "q = " << q.transpose();
    }
  }
}

TEST_P(HandModelOfEachSkeleton, FingerPointsMoveWithTheJointThatCarriesThem) {
  const HandModel model = model_of(GetParam());
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

TEST(HandModel, ForcesAttachmentsOntoTheirFinger) {
  HandModelConfig config;
  config.attachments[1][0].joint = 99;
  config.attachments[1][1].joint = 0;
  const HandModel model(config);
  EXPECT_EQ(model.joints_moving(Finger::kIndex, 0), 3u);
  EXPECT_EQ(model.joints_moving(Finger::kIndex, 1), 1u);
}

}  // namespace
}  // namespace embody::hand
