#include <gtest/gtest.h>
#include <toml++/toml.h>

#include <cmath>
#include <functional>
#include <set>

#include "core/embodiment/onboarding.hpp"
#include "core/hand/hand_data.hpp"
#include "core/math/pose.hpp"
#include "daemon/evaluate/onboard_toml.hpp"
#include "tests/unit/math/random_values.hpp"
#include "tests/unit/robot/changed_hands.hpp"

namespace embody {
namespace {

using Eigen::Vector3d;

const std::set<std::string> kKeys{
    "name",  "urdf",  "root_link", "side", "file_side", "X_PM", "motors", "motor_lower_rad", "motor_upper_rad",
    "thumb", "index", "middle",    "ring", "little"};
const std::set<std::string> kFingerKeys{"link", "tip_m", "middle_link", "middle_m", "pads"};
const std::set<std::string> kPadKeys{"link", "from_m", "to_m", "radius_m", "facing", "width_m"};

/// Sampling is not what most tests are about.
OnboardingOptions quick() {
  OnboardingOptions options;
  options.urdf = "hand.urdf";
  options.robot_samples = 200;
  options.human_samples = 20;
  return options;
}

Vector3d vector(const toml::node& node) {
  const toml::array& array = *node.as_array();
  return {array.at(0).value<double>().value(), array.at(1).value<double>().value(),
          array.at(2).value<double>().value()};
}

class ShippedHand : public testing::TestWithParam<const char*> {};

TEST_P(ShippedHand, TheFileReadBackHasOnlyKnownKeysAndNamesOnlyWhatTheUrdfHas) {
  const robot::RobotModel model = test::shipped_model(GetParam());
  const auto onboarding = onboard_hand(model, quick());
  ASSERT_TRUE(onboarding.ok()) << onboarding.error().detail.c_str();
  const std::string text = evaluate::onboard_toml(*onboarding, "hand.urdf");
  toml::table file;
  ASSERT_NO_THROW(file = toml::parse(text)) << text;
  for (const auto& [key, value] : file) EXPECT_TRUE(kKeys.count(std::string(key.str()))) << key.str();
  EXPECT_EQ(file["root_link"].value<std::string>(), model.links[0].name);
  EXPECT_EQ(file["urdf"].value<std::string>(), "hand.urdf");
  EXPECT_EQ(file["X_PM"].as_array()->size(), 6U);
  const std::size_t motors = file["motors"].as_array()->size();
  ASSERT_EQ(file["motor_lower_rad"].as_array()->size(), motors);
  ASSERT_EQ(file["motor_upper_rad"].as_array()->size(), motors);
  for (std::size_t i = 0; i < motors; ++i) {
    const auto joint = model.find_joint(file["motors"][i].value<std::string>().value());
    ASSERT_TRUE(joint.has_value());
    EXPECT_FALSE(model.joints[*joint].mimic.has_value());
    const double lower = file["motor_lower_rad"][i].value<double>().value();
    const double upper = file["motor_upper_rad"][i].value<double>().value();
    EXPECT_LT(lower, upper);
    EXPECT_GE(lower, model.joints[*joint].lower - 1e-9);
    EXPECT_LE(upper, model.joints[*joint].upper + 1e-9);
  }
  for (std::size_t f = 0; f < kFingers; ++f) {
    const toml::table* finger = file[kFingerNames[f]].as_table();
    ASSERT_EQ(finger != nullptr, onboarding->anatomy.fingers[f].has_value()) << kFingerNames[f];
    if (finger == nullptr) continue;
    for (const auto& [key, value] : *finger) EXPECT_TRUE(kFingerKeys.count(std::string(key.str()))) << key.str();
    EXPECT_TRUE(model.find_link((*finger)["link"].value<std::string>().value()));
    EXPECT_NEAR((vector(*(*finger).get("tip_m")) - onboarding->config.fingers[f].tip_m).norm(), 0.0, 1e-6);
    EXPECT_TRUE(model.find_link((*finger)["middle_link"].value_or(std::string(model.links[0].name))));
    for (const toml::node& node : *(*finger)["pads"].as_array()) {
      const toml::table& pad = *node.as_table();
      for (const auto& [key, value] : pad) EXPECT_TRUE(kPadKeys.count(std::string(key.str()))) << key.str();
      EXPECT_TRUE(model.find_link(pad["link"].value<std::string>().value()));
      const Vector3d facing = vector(*pad.get("facing")), axis = vector(*pad.get("to_m")) - vector(*pad.get("from_m"));
      EXPECT_NEAR(facing.norm(), 1.0, 1e-5);
      EXPECT_NEAR(facing.dot(axis), 0.0, 1e-5);
      EXPECT_GT(axis.norm(), 0.0);
    }
  }
}

TEST_P(ShippedHand, TextAndJsonNameEveryFingerAndEverySentence) {
  const robot::RobotModel model = test::shipped_model(GetParam());
  const auto onboarding = onboard_hand(model, quick());
  ASSERT_TRUE(onboarding.ok());
  const std::string text = evaluate::onboard_text(model, *onboarding),
                    json = evaluate::onboard_json(model, *onboarding);
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!onboarding->anatomy.fingers[f]) continue;
    EXPECT_NE(text.find(std::string("\n") + kFingerNames[f] + " "), std::string::npos) << text;
    EXPECT_NE(json.find(std::string("\"") + kFingerNames[f] + "\""), std::string::npos) << json;
  }
  EXPECT_FALSE(onboarding->check_by_eye.empty());
  for (const std::string& line : onboarding->check_by_eye) {
    EXPECT_EQ(line.back(), '.') << line;
    EXPECT_NE(text.find(line), std::string::npos) << line;
  }
}

TEST_P(ShippedHand, PadsFaceTheWayInWhichClosingMovesTheTip) {
  const robot::RobotModel model = test::shipped_model(GetParam());
  const auto onboarding = onboard_hand(model, quick());
  ASSERT_TRUE(onboarding.ok());
  const auto X_PL = robot::link_poses(model, robot::open_posture(model));
  for (std::size_t f = 0; f < kFingers; ++f) {
    for (const ContactPad& pad : onboarding->config.fingers[f].pads) {
      const Vector3d facing_P = X_PL[*model.find_link(pad.link)].linear() * pad.facing;
      EXPECT_GT(facing_P.dot(onboarding->anatomy.fingers[f]->v_closing_P.normalized()), 0.2) << kFingerNames[f];
    }
  }
}

TEST_P(ShippedHand, IsTheSameEveryTime) {
  const robot::RobotModel model = test::shipped_model(GetParam());
  const auto a = onboard_hand(model, quick()), b = onboard_hand(model, quick());
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(evaluate::onboard_json(model, *a), evaluate::onboard_json(model, *b));
  EXPECT_EQ(evaluate::onboard_toml(*a, ""), evaluate::onboard_toml(*b, ""));
}

TEST_P(ShippedHand, FollowsTheRootLinkAndScoresTheSameWhereverThatIs) {
  const robot::RobotModel model = test::shipped_model(GetParam());
  const math::Pose X = math::pose_from(Vector3d(.3, -.2, .7), Vector3d(.5, -1.1, .8));
  const auto here = onboard_hand(model, quick()), there = onboard_hand(test::rerooted(model, X), quick());
  ASSERT_TRUE(here.ok() && there.ok());
  EXPECT_TRUE((X * math::exp_se3(here->config.X_PM)).isApprox(math::exp_se3(there->config.X_PM), 1e-6));
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!here->score.fingers[f]) continue;
    EXPECT_NEAR(here->score.fingers[f]->length_m, there->score.fingers[f]->length_m, 1e-9);
    EXPECT_NEAR(here->score.fingers[f]->reach, there->score.fingers[f]->reach, 0.051);  // one of twenty at the border
    EXPECT_NEAR((here->config.fingers[f].middle_m - there->config.fingers[f].middle_m).norm(), 0.0, 1e-9);
  }
}

INSTANTIATE_TEST_SUITE_P(Each, ShippedHand, testing::Values("mia", "shadow", "barrett", "robotiq_2f140"));

/// A robot of the human hand's own bones: wrist, then three joints and a tip frame per finger. Finger joints flex about
/// z, as in M; the thumb's about the direction that closes it over the palm.
robot::RobotModel human_robot(Side side, const Pose& X_PM) {
  const hand::HandData human = hand::builtin_hand(hand::Skeleton::kBoneLengths, side);
  const double mirror = side == Side::kRight ? 1.0 : -1.0;
  robot::RobotModel model;
  model.name = "human";
  model.links.push_back({"base", robot::kNoIndex});
  const auto add = [&](const std::string& name, std::size_t parent, const Pose& X_PC, const Vector3d& axis,
                       bool fixed) {
    robot::Joint joint;
    joint.name = "j_" + name;
    joint.type = fixed ? robot::JointType::kFixed : robot::JointType::kRevolute;
    joint.parent_link = parent;
    joint.child_link = model.links.size();
    joint.X_PC = X_PC;
    joint.axis = axis.normalized();
    joint.upper = fixed ? 0.0 : 1.7;
    model.links.push_back({name, model.joints.size()});
    model.joints.push_back(joint);
    return joint.child_link;
  };
  for (std::size_t f = 0; f < kFingers; ++f) {
    const auto first = static_cast<Eigen::Index>(hand::first_joint(static_cast<Finger>(f)));
    const Vector3d axis = f == 0 ? Vector3d(0.1, mirror * 1.0, mirror * 0.4) : Vector3d(0.0, 0.0, mirror);
    std::size_t link = 0;
    Vector3d before = Vector3d::Zero();
    for (Eigen::Index k = f == 0 ? 1 : 0; k < 4; ++k) {
      const Vector3d p =
          k < 3 ? Vector3d(human.joints_M.col(first + k)) : Vector3d(human.tips_M.col(static_cast<Eigen::Index>(f)));
      Pose X = Pose::Identity();
      X.translation() = p - before;
      if (link == 0) X = X_PM * X;
      link = add(std::string(kFingerNames[f]) + std::to_string(k), link, X, axis, k == 3);
      before = p;
    }
  }
  return model;
}

TEST(Onboarding, AHumanHandAsARobotGetsItsOwnPoseItsOwnLengthAndItsOwnSide) {
  test::RandomValues random(11);
  for (const Side side : {Side::kRight, Side::kLeft}) {
    for (int i = 0; i < 5; ++i) {
      const Pose X_PM = math::pose_from(random.vector<3>(-0.3, 0.3), random.rotation(3.0));
      const auto onboarding = onboard_hand(human_robot(side, X_PM), quick());
      ASSERT_TRUE(onboarding.ok()) << onboarding.error().detail.c_str();
      EXPECT_EQ(onboarding->config.file_side, side);
      EXPECT_TRUE(math::exp_se3(onboarding->config.X_PM).isApprox(X_PM, 1e-6));
      EXPECT_NEAR(onboarding->score.fit_m, 0.0, 1e-6);
      EXPECT_NEAR(onboarding->score.scale, 1.0, 1e-6);
      for (std::size_t f = 0; f < kFingers; ++f) {
        ASSERT_TRUE(onboarding->score.fingers[f].has_value());
        EXPECT_NEAR(onboarding->score.fingers[f]->length_m, onboarding->score.fingers[f]->human_length_m, 1e-9);
        EXPECT_EQ(onboarding->config.fingers[f].link, std::string(kFingerNames[f]) + "3");
      }
    }
  }
}

TEST(Onboarding, AHandThatMirrorsScoresTheSame) {
  OnboardingOptions options;
  options.robot_samples = 4'000;
  options.human_samples = 200;
  const robot::RobotModel model = test::shipped_model("shadow");
  const auto right = onboard_hand(model, options), left = onboard_hand(test::mirrored(model), options);
  ASSERT_TRUE(right.ok() && left.ok());
  EXPECT_EQ(left->config.side, Side::kLeft);
  for (std::size_t f = 0; f < kFingers; ++f) {
    EXPECT_NEAR(left->score.fingers[f]->reach, right->score.fingers[f]->reach, 0.011) << kFingerNames[f];
    EXPECT_NEAR(
        (left->config.fingers[f].tip_m - Vector3d(-1, 1, 1).cwiseProduct(right->config.fingers[f].tip_m)).norm(), 0.0,
        1e-9);
  }
}

TEST(Onboarding, AFingerCutInHalfReachesLess) {
  OnboardingOptions options;
  options.robot_samples = 4'000;
  options.human_samples = 200;
  const robot::RobotModel model = test::shipped_model("shadow");
  robot::RobotModel stiff = model;
  for (const char* name : {"rh_FFJ3", "rh_FFJ2", "rh_FFJ1"}) stiff.joints[*stiff.find_joint(name)].upper *= 0.3;
  const auto whole = onboard_hand(model, options), half = onboard_hand(stiff, options);
  ASSERT_TRUE(whole.ok() && half.ok());
  EXPECT_LT(half->score.fingers[1]->reach, 0.7 * whole->score.fingers[1]->reach);
  EXPECT_GT(*half->score.fingers[1]->pinch_m, *whole->score.fingers[1]->pinch_m + 0.005);
}

TEST(Onboarding, TheShadowHandPinchesWithEveryFingerAndMotorsAreTheIndependentJointsOfItsFingers) {
  const robot::RobotModel model = test::shipped_model("shadow");
  const auto onboarding = onboard_hand(model, {});
  ASSERT_TRUE(onboarding.ok());
  EXPECT_EQ(onboarding->config.motors.size(), 22U);  // 24 with the wrist
  for (const std::string& motor : onboarding->config.motors) EXPECT_EQ(motor.find("WRJ"), std::string::npos);
  for (std::size_t f = 1; f < kFingers; ++f) EXPECT_LT(*onboarding->score.fingers[f]->pinch_m, 0.002);
  for (std::size_t f = 1; f < kFingers; ++f) EXPECT_GT(onboarding->score.fingers[f]->reach, 0.5);
}

TEST(Onboarding, ProposedPointsAreNearThoseOfTheShippedShadowFile) {
  const robot::RobotModel model = test::shipped_model("shadow");
  const auto onboarding = onboard_hand(model, quick());
  ASSERT_TRUE(onboarding.ok());
  const toml::table file = toml::parse(test::shipped_file("shadow.toml"));
  for (std::size_t f = 0; f < kFingers; ++f) {
    const toml::table& shipped = *file[kFingerNames[f]].as_table();
    const FingerPoints& proposed = onboarding->config.fingers[f];
    EXPECT_EQ(proposed.link, shipped["link"].value<std::string>());
    EXPECT_EQ(proposed.middle_link, shipped["middle_link"].value<std::string>());
    EXPECT_LT((proposed.tip_m - vector(*shipped.get("tip_m"))).norm(), 0.006) << kFingerNames[f];
    EXPECT_LT((proposed.middle_m - vector(*shipped.get("middle_m"))).norm(), 0.006) << kFingerNames[f];
    EXPECT_GT(proposed.pads[0].facing.dot(vector(*(*shipped["pads"].as_array())[0].as_table()->get("facing"))), 0.9);
  }
}

TEST(Onboarding, NamesThatTomlCannotCarryAsTheyAreComeBackUnchanged) {
  robot::RobotModel model = test::shipped_model("mia");
  const std::string odd = "q\"uote\\back\nline\x7f#";
  model.joints[*model.find_joint("j_thumb_fle")].name = odd;
  model.name = odd;
  const auto onboarding = onboard_hand(model, quick());
  ASSERT_TRUE(onboarding.ok());
  const toml::table file = toml::parse(evaluate::onboard_toml(*onboarding, "a\n[b]"));
  EXPECT_EQ(file["name"].value<std::string>(), odd);
  bool found = false;
  for (const toml::node& motor : *file["motors"].as_array()) found = found || motor.value<std::string>() == odd;
  EXPECT_TRUE(found);
  EXPECT_FALSE(file.contains("b"));
}

TEST(Onboarding, AChainIsRefusedWithOneSentence) {
  robot::RobotModel model = test::shipped_model("mia");
  model.links.resize(1);
  model.joints.clear();
  const auto onboarding = onboard_hand(model, quick());
  ASSERT_FALSE(onboarding.ok());
  EXPECT_EQ(onboarding.error().code, Errc::kUnsupported);
}

}  // namespace
}  // namespace embody
