#include <gtest/gtest.h>

#include "core/embodiment/mirror_config.hpp"
#include "core/robot/mirror.hpp"
#include "tests/unit/math/random_values.hpp"
#include "tests/unit/robot/hand_files.hpp"

namespace embody {
namespace {

using Eigen::Vector3d;
using robot::JointType;
using robot::RobotModel;

/// Angles (or lengths) within the limits of all moving joints, each for itself: the law needs no couplings.
std::vector<double> random_angles(const RobotModel& model, test::RandomValues& random) {
  std::vector<double> q;
  for (const robot::Joint& joint : model.joints) {
    const bool bounded = joint.type == JointType::kRevolute || joint.type == JointType::kPrismatic;
    q.push_back(bounded ? random(joint.lower, joint.upper) : random(-3.0, 3.0));
  }
  return q;
}

/// Written out, so that it does not share a mistake with the code under test.
Pose reflected(const Pose& X) {
  Eigen::Matrix4d S = Eigen::Matrix4d::Identity();
  S(0, 0) = -1.0;
  return Pose(S * X.matrix() * S);
}

/// A chain of joints of every type with axes and origins at random.
RobotModel random_chain(test::RandomValues& random) {
  constexpr std::array<JointType, 4> kTypes{JointType::kRevolute, JointType::kPrismatic, JointType::kContinuous,
                                            JointType::kFixed};
  RobotModel model;
  model.name = "chain";
  model.links.push_back({"0", robot::kNoIndex});
  for (std::size_t i = 0; i < 12; ++i) {
    robot::Joint joint;
    joint.name = "joint " + std::to_string(i);
    joint.type = kTypes[i % 4];
    joint.parent_link = i;
    joint.child_link = i + 1;
    joint.X_PC = math::pose_from(random.vector<3>(-0.1, 0.1), random.rotation(3.0));
    joint.axis = random.rotation(3.0).normalized();
    joint.lower = -0.5;
    joint.upper = 1.5;
    if (i == 4) joint.mimic = robot::Mimic{0, -0.7, 0.2};
    model.links.push_back({std::to_string(i + 1), i});
    model.joints.push_back(joint);
  }
  return model;
}

void expect_mirror_image(const RobotModel& model, test::RandomValues& random) {
  const RobotModel mirror = robot::mirrored(model);
  for (int n = 0; n < 50; ++n) {
    const std::vector<double> q = random_angles(model, random);
    const std::vector<Pose> X_PL = test::link_poses(model, q), X_PLm = test::link_poses(mirror, q);
    for (std::size_t link = 0; link < X_PL.size(); ++link) {
      ASSERT_LE((X_PLm[link].matrix() - reflected(X_PL[link]).matrix()).cwiseAbs().maxCoeff(), 1e-12)
          << model.name << " " << model.links[link].name;
      ASSERT_TRUE(math::is_valid(X_PLm[link]));
    }
  }
}

void expect_equal(const RobotModel& a, const RobotModel& b) {
  ASSERT_EQ(a.joints.size(), b.joints.size());
  ASSERT_EQ(a.links.size(), b.links.size());
  for (std::size_t i = 0; i < a.joints.size(); ++i) {
    EXPECT_EQ(a.joints[i].name, b.joints[i].name);
    EXPECT_EQ(a.joints[i].X_PC.matrix(), b.joints[i].X_PC.matrix());
    EXPECT_EQ(a.joints[i].axis, b.joints[i].axis);
  }
}

TEST(MirroredModel, TakesTheMirrorImagePostureAtTheSameAngles) {
  test::RandomValues random(3);
  for (const char* hand : test::kHandFiles) expect_mirror_image(test::hand_model(hand), random);
  for (int n = 0; n < 20; ++n) expect_mirror_image(random_chain(random), random);
}

TEST(MirroredModel, IsTheOriginalWhenMirroredTwice) {
  test::RandomValues random(4);
  for (const char* hand : test::kHandFiles) {
    const RobotModel model = test::hand_model(hand);
    expect_equal(robot::mirrored(robot::mirrored(model)), model);
  }
  const RobotModel chain = random_chain(random);
  expect_equal(robot::mirrored(robot::mirrored(chain)), chain);
}

TEST(MirroredModel, KeepsNamesTreeLimitsAndMimics) {
  test::RandomValues random(5);
  const RobotModel model = random_chain(random), mirror = robot::mirrored(model);
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    EXPECT_EQ(mirror.joints[i].name, model.joints[i].name);
    EXPECT_EQ(mirror.joints[i].type, model.joints[i].type);
    EXPECT_EQ(mirror.joints[i].parent_link, model.joints[i].parent_link);
    EXPECT_EQ(mirror.joints[i].child_link, model.joints[i].child_link);
    EXPECT_EQ(mirror.joints[i].lower, model.joints[i].lower);
    EXPECT_EQ(mirror.joints[i].upper, model.joints[i].upper);
    ASSERT_EQ(mirror.joints[i].mimic.has_value(), model.joints[i].mimic.has_value());
  }
  EXPECT_EQ(mirror.joints[4].mimic->joint, 0U);
  EXPECT_EQ(mirror.joints[4].mimic->multiplier, -0.7);
  EXPECT_EQ(mirror.joints[4].mimic->offset, 0.2);
}

TEST(MirroredExponential, IsTheExponentialOfTheMirroredPose) {
  test::RandomValues random(6);
  for (int n = 0; n < 1000; ++n) {
    Vector6 w_v;
    w_v << random.rotation(6.0), random.vector<3>(-0.5, 0.5);
    const Pose X = math::exp_se3(robot::mirrored_exponential(w_v));
    ASSERT_LE((X.matrix() - reflected(math::exp_se3(w_v)).matrix()).cwiseAbs().maxCoeff(), 1e-12);
    ASSERT_LE((X.matrix() - robot::mirrored(math::exp_se3(w_v)).matrix()).cwiseAbs().maxCoeff(), 1e-12);
  }
}

/// Tip, middle, ends of the pads and the pads' directions (as points 1 m away) of a hand, in its human frame M.
std::vector<Vector3d> points_M(const EmbodimentConfig& config, const RobotModel& model, const std::vector<double>& q) {
  const std::vector<Pose> X_PL = test::link_poses(model, q);
  const Pose X_MP = math::exp_se3(config.X_PM).inverse();
  std::vector<Vector3d> points;
  const auto add = [&](const std::string& link, const Vector3d& p_L) {
    points.push_back(X_MP * X_PL[model.find_link(link).value()] * p_L);
  };
  for (const FingerPoints& finger : config.fingers) {
    if (finger.link.empty()) continue;
    add(finger.link, finger.tip_m);
    add(finger.middle_link.empty() ? finger.link : finger.middle_link, finger.middle_m);
    for (const ContactPad& pad : finger.pads) {
      add(pad.link, pad.from_m);
      add(pad.link, pad.to_m);
      add(pad.link, pad.from_m + pad.facing);
    }
  }
  return points;
}

TEST(MirroredConfig, AMirroredHumanHandSeesTheMirrorImageOfEveryPoint) {
  test::RandomValues random(8);
  for (const char* hand : test::kHandFiles) {
    const RobotModel model = test::hand_model(hand), mirror = robot::mirrored(model);
    const EmbodimentConfig config = test::hand_config(hand), other = mirrored(config);
    for (int n = 0; n < 20; ++n) {
      const std::vector<double> q = random_angles(model, random);
      const std::vector<Vector3d> right = points_M(config, model, q), left = points_M(other, mirror, q);
      ASSERT_EQ(left.size(), right.size());
      for (std::size_t i = 0; i < right.size(); ++i) {
        ASSERT_LE((left[i] - Vector3d(-right[i].x(), right[i].y(), right[i].z())).norm(), 1e-12) << hand << " " << i;
      }
    }
  }
}

TEST(MirroredConfig, KeepsMotorsAndWeightsAndDescribesTheOtherSide) {
  EmbodimentConfig config = test::hand_config("shadow");
  config.side = Side::kLeft;
  config.orientation_m = 0.01;
  const EmbodimentConfig other = mirrored(config);
  EXPECT_EQ(config.file_side, Side::kRight);
  EXPECT_EQ(other.file_side, Side::kLeft);
  EXPECT_EQ(other.side, Side::kLeft);
  EXPECT_EQ(other.motors, config.motors);
  EXPECT_EQ(other.motor_lower_rad, config.motor_lower_rad);
  EXPECT_EQ(other.motor_upper_rad, config.motor_upper_rad);
  ASSERT_EQ(other.couplings.size(), config.couplings.size());
  EXPECT_EQ(other.couplings[1].joint_rad, config.couplings[1].joint_rad);
  EXPECT_EQ(other.orientation_m, 0.01);
  const EmbodimentConfig again = mirrored(other);
  EXPECT_EQ(again.file_side, Side::kRight);
  EXPECT_EQ(again.X_PM, config.X_PM);
  for (std::size_t i = 0; i < kFingers; ++i) {
    EXPECT_EQ(again.fingers[i].link, config.fingers[i].link);
    EXPECT_EQ(again.fingers[i].tip_m, config.fingers[i].tip_m);
    EXPECT_EQ(again.fingers[i].middle_m, config.fingers[i].middle_m);
    ASSERT_EQ(again.fingers[i].pads.size(), config.fingers[i].pads.size());
    for (std::size_t k = 0; k < again.fingers[i].pads.size(); ++k) {
      EXPECT_EQ(again.fingers[i].pads[k].from_m, config.fingers[i].pads[k].from_m);
      EXPECT_EQ(again.fingers[i].pads[k].to_m, config.fingers[i].pads[k].to_m);
      EXPECT_EQ(again.fingers[i].pads[k].facing, config.fingers[i].pads[k].facing);
      EXPECT_EQ(again.fingers[i].pads[k].radius_m, config.fingers[i].pads[k].radius_m);
    }
  }
}

}  // namespace
}  // namespace embody
