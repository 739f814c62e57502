#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

#include "core/math/pose.hpp"
#include "core/robot/hand_anatomy.hpp"
#include "tests/unit/math/random_values.hpp"
#include "tests/unit/robot/changed_hands.hpp"

namespace embody::robot {
namespace {

using Eigen::Vector3d;

/// What a person sees: link that carries the tip (the last moving one) by finger, "" for none; and the tip's place in
/// the frame of `tip_link` as the shipped hand files have it (10 to 15 mm off the finger's axis).
struct Known {
  const char* hand;
  const char* palm;
  std::array<const char*, kFingers> links;
  std::array<const char*, kFingers> tip_links;
  std::array<Vector3d, kFingers> tips_m;
  bool side_sure;
  ThumbRule rule;
  double tolerance_m;  ///< how far a tip by the rules may be from the file's point
};

void PrintTo(const Known& known, std::ostream* out) {
  *out << known.hand;
}

const Vector3d kNone = Vector3d::Zero();

std::vector<Known> known_hands() {
  return {
      {"mia",
       "palm",
       {"thumb_fle", "index_fle", "middle_fle", "ring_fle", "little_fle"},
       {"thumb_fle", "index_fle", "middle_fle", "ring_fle", "little_fle"},
       {Vector3d(.03, .07, 0), Vector3d(-.015, .09, 0), Vector3d(-.015, .09, 0), Vector3d(-.012, .083, 0),
        Vector3d(-.01, .068, 0)},
       true,
       ThumbRule::kAxis,
       .025},
      {"shadow",
       "rh_palm",
       {"rh_thdistal", "rh_ffdistal", "rh_mfdistal", "rh_rfdistal", "rh_lfdistal"},
       {"rh_thtip", "rh_fftip", "rh_mftip", "rh_rftip", "rh_lftip"},
       {Vector3d(0, .013, 0), Vector3d(0, .01, 0), Vector3d(0, .01, 0), Vector3d(0, .01, 0), Vector3d(0, .01, 0)},
       true,
       ThumbRule::kAxis,
       .0131},
      // Finger 3, which cannot spread, stands opposite to the two that can. The published configuration takes finger 2
      // for the thumb: with its spread turned to the other side that is as good a view.
      {"barrett",
       "base_link",
       {"finger_3_dist_link", "finger_1_dist_link", "finger_2_dist_link", "", ""},
       {"finger_3_dist_link", "finger_1_dist_link", "finger_2_dist_link", "", ""},
       {Vector3d(-.045, .027, 0), Vector3d(-.045, .027, 0), Vector3d(-.045, .027, 0), kNone, kNone},
       false,
       ThumbRule::kAxis,
       .03},
      {"robotiq_2f140",
       "robotiq_arg2f_base_link",
       {"left_inner_finger", "right_inner_finger", "", "", ""},
       {"left_inner_finger_pad", "right_inner_finger_pad", "", "", ""},
       {Vector3d(0, .03, .01), Vector3d(0, .03, .01), kNone, kNone, kNone},
       false,
       ThumbRule::kFirst,
       .032},
  };
}

class KnownHand : public testing::TestWithParam<Known> {};

TEST_P(KnownHand, FingersTipsAndSideAreThoseThatAPersonSees) {
  const Known& known = GetParam();
  const RobotModel model = test::shipped_model(known.hand);
  const auto hand = find_hand_anatomy(model);
  ASSERT_TRUE(hand.ok()) << hand.error().detail.c_str();
  EXPECT_EQ(model.links[hand->palm_link].name, known.palm);
  EXPECT_EQ(hand->thumb_rule, known.rule);
  EXPECT_EQ(hand->side, Side::kRight);
  EXPECT_EQ(hand->side_sure, known.side_sure);
  for (std::size_t f = 0; f < kFingers; ++f) {
    ASSERT_EQ(hand->fingers[f].has_value(), known.links[f][0] != '\0') << kFingerNames[f];
    if (!hand->fingers[f]) continue;
    EXPECT_EQ(model.links[hand->fingers[f]->last_link].name, known.links[f]) << kFingerNames[f];
    EXPECT_EQ(model.links[hand->fingers[f]->tip_link].name, known.tip_links[f]) << kFingerNames[f];
    EXPECT_LT((hand->fingers[f]->p_tip_L - known.tips_m[f]).norm(), known.tolerance_m) << kFingerNames[f];
  }
  EXPECT_TRUE(hand->left_out.empty());
}

/// What must not depend on names, order or placement: link indices through their original names, and vectors in the
/// palm frame.
void expect_same(const RobotModel& model, const HandAnatomy& hand, const RobotModel& changed_model,
                 const HandAnatomy& changed, const std::function<std::string(const std::string&)>& original) {
  EXPECT_EQ(original(changed_model.links[changed.palm_link].name), model.links[hand.palm_link].name);
  EXPECT_EQ(changed.side_sure, hand.side_sure);
  EXPECT_EQ(changed.thumb_rule, hand.thumb_rule);
  EXPECT_EQ(changed.bars.size(), hand.bars.size());
  EXPECT_EQ(changed.mimic_groups.size(), hand.mimic_groups.size());
  for (std::size_t f = 0; f < kFingers; ++f) {
    ASSERT_EQ(changed.fingers[f].has_value(), hand.fingers[f].has_value());
    if (!hand.fingers[f]) continue;
    const SerialFinger &a = *hand.fingers[f], &b = *changed.fingers[f];
    EXPECT_EQ(original(changed_model.links[b.tip_link].name), model.links[a.tip_link].name) << kFingerNames[f];
    EXPECT_EQ(b.tip_rule, a.tip_rule);
    ASSERT_EQ(b.joints.size(), a.joints.size());
    EXPECT_EQ(b.knuckle, a.knuckle);
    EXPECT_NEAR((b.p_tip_L - a.p_tip_L).norm(), 0.0, 1e-9) << kFingerNames[f];
    const Vector3d a_Q = hand.X_PQ.inverse() * a.p_tip_P, b_Q = changed.X_PQ.inverse() * b.p_tip_P;
    EXPECT_NEAR((a_Q - b_Q).norm(), 0.0, 1e-9) << kFingerNames[f];
  }
}

TEST_P(KnownHand, DoesNotDependOnNames) {
  const RobotModel model = test::shipped_model(GetParam().hand);
  const auto hand = find_hand_anatomy(model);
  ASSERT_TRUE(hand.ok());
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    std::map<std::string, std::string> old_name;
    const RobotModel other = test::renamed(model, seed, old_name);
    const auto changed = find_hand_anatomy(other);
    ASSERT_TRUE(changed.ok()) << changed.error().detail.c_str();
    expect_same(model, *hand, other, *changed, [&](const std::string& name) { return old_name.at(name); });
  }
}

TEST_P(KnownHand, DoesNotDependOnTheOrderOfLinksAndJoints) {
  const RobotModel model = test::shipped_model(GetParam().hand);
  const auto hand = find_hand_anatomy(model);
  ASSERT_TRUE(hand.ok());
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const RobotModel other = test::reordered(model, seed);
    const auto changed = find_hand_anatomy(other);
    ASSERT_TRUE(changed.ok()) << changed.error().detail.c_str();
    expect_same(model, *hand, other, *changed, [](const std::string& name) { return name; });
  }
}

TEST_P(KnownHand, DoesNotDependOnWhereTheRootLinkIs) {
  const RobotModel model = test::shipped_model(GetParam().hand);
  const auto hand = find_hand_anatomy(model);
  ASSERT_TRUE(hand.ok());
  test::RandomValues random(7);
  for (int i = 0; i < 50; ++i) {
    const math::Pose X = math::pose_from(random.vector<3>(-1.0, 1.0), random.rotation(3.1));
    const RobotModel other = test::rerooted(model, X);
    const auto changed = find_hand_anatomy(other);
    ASSERT_TRUE(changed.ok()) << changed.error().detail.c_str();
    expect_same(model, *hand, other, *changed, [](const std::string& name) { return name; });
    EXPECT_TRUE(changed->X_PQ.isApprox(X * hand->X_PQ, 1e-9));
    EXPECT_EQ(changed->side, hand->side);
  }
}

TEST_P(KnownHand, TheMirrorImageIsTheOtherSideWithTheSameFingers) {
  if (!GetParam().side_sure) GTEST_SKIP() << "it has no side";
  const RobotModel model = test::shipped_model(GetParam().hand);
  const auto hand = find_hand_anatomy(model);
  const RobotModel other = test::mirrored(model);
  const auto changed = find_hand_anatomy(other);
  ASSERT_TRUE(hand.ok() && changed.ok());
  EXPECT_NE(changed->side, hand->side);
  EXPECT_TRUE(changed->side_sure);
  for (std::size_t f = 0; f < kFingers; ++f) {
    ASSERT_TRUE(changed->fingers[f].has_value());
    EXPECT_EQ(changed->fingers[f]->tip_link, hand->fingers[f]->tip_link) << kFingerNames[f];
    const Vector3d p = hand->fingers[f]->p_tip_P;
    EXPECT_NEAR((changed->fingers[f]->p_tip_P - Vector3d(-p.x(), p.y(), p.z())).norm(), 0.0, 1e-9);
  }
}

TEST_P(KnownHand, ClosingMovesTheFingersToThePalmarSideAndThePalmFrameIsAFrame) {
  const RobotModel model = test::shipped_model(GetParam().hand);
  const auto hand = find_hand_anatomy(model);
  ASSERT_TRUE(hand.ok());
  EXPECT_TRUE(math::is_valid(hand->X_PQ));
  EXPECT_NEAR(hand->X_PQ.linear().determinant(), 1.0, 1e-9);
  for (std::size_t f = 1; f < kFingers; ++f) {
    if (!hand->fingers[f]) continue;
    EXPECT_GT(hand->fingers[f]->v_closing_P.dot(hand->X_PQ.linear().col(1)), 0.0) << kFingerNames[f];
    EXPECT_GT(hand->fingers[f]->direction_P().dot(hand->X_PQ.linear().col(0)), 0.5) << kFingerNames[f];
  }
}

INSTANTIATE_TEST_SUITE_P(Each, KnownHand, testing::ValuesIn(known_hands()));

TEST(HandAnatomy, JointsOfTheWristStandBeforeThePalm) {
  const RobotModel model = test::shipped_model("shadow");
  const auto hand = find_hand_anatomy(model);
  ASSERT_TRUE(hand.ok());
  ASSERT_EQ(hand->wrist_joints.size(), 2U);
  EXPECT_EQ(model.joints[hand->wrist_joints[0]].name, "rh_WRJ2");
  EXPECT_EQ(model.joints[hand->wrist_joints[1]].name, "rh_WRJ1");
}

TEST(HandAnatomy, BarsOfALinkageAreNoFingers) {
  const RobotModel model = test::shipped_model("robotiq_2f140");
  const auto hand = find_hand_anatomy(model);
  ASSERT_TRUE(hand.ok());
  ASSERT_EQ(hand->bars.size(), 2U);
  for (const SerialFinger& bar : hand->bars) {
    EXPECT_NE(model.links[bar.last_link].name.find("inner_knuckle"), std::string::npos);
  }
}

std::string joint_text(const std::string& name, const std::string& parent, const std::string& child,
                       const std::string& xyz, const std::string& axis) {
  return "<link name='" + child + "'/><joint name='" + name + "' type='revolute'><parent link='" + parent +
         "'/><child link='" + child + "'/><origin xyz='" + xyz + "'/><axis xyz='" + axis +
         "'/><limit lower='0' upper='1.5' effort='1' velocity='1'/></joint>";
}

std::string robot_text(const std::string& body) {
  return "<robot name='r'><link name='p'/>" + body + "</robot>";
}

struct NoHand {
  const char* title;
  std::string text;
  const char* mentions;
};

void PrintTo(const NoHand& no_hand, std::ostream* out) {
  *out << no_hand.title;
}

class NoHands : public testing::TestWithParam<NoHand> {};

TEST_P(NoHands, GiveOneSentence) {
  const auto model = load_urdf(GetParam().text);
  ASSERT_TRUE(model.ok()) << model.error().detail.c_str();
  const auto hand = find_hand_anatomy(*model);
  ASSERT_FALSE(hand.ok());
  EXPECT_EQ(hand.error().code, Errc::kUnsupported);
  const std::string sentence(hand.error().detail.view());
  EXPECT_NE(sentence.find(GetParam().mentions), std::string::npos) << sentence;
}

std::string star(int branches) {
  std::string body;
  for (int i = 0; i < branches; ++i) {
    body += joint_text("j" + std::to_string(i), "p", "l" + std::to_string(i), "0 0 .1", "1 0 0");
  }
  return robot_text(body);
}

INSTANTIATE_TEST_SUITE_P(
    Each, NoHands,
    testing::Values(NoHand{"nothing moves", robot_text(""), "two moving joints"},
                    NoHand{"a chain",
                           robot_text(joint_text("a", "p", "l1", "0 0 .1", "1 0 0") +
                                      joint_text("b", "l1", "l2", "0 0 .1", "1 0 0") +
                                      joint_text("c", "l2", "l3", "0 0 .1", "1 0 0")),
                           "two moving joints"},
                    NoHand{"a star", star(2000), "2000 branches"},
                    NoHand{"one finger and a bar",
                           robot_text(joint_text("a", "p", "l1", "0 0 .1", "1 0 0") +
                                      joint_text("b", "l1", "l2", "0 0 .1", "1 0 0") +
                                      joint_text("c", "p", "l3", "0 .01 .1", "1 0 0")),
                           "one finger"},
                    NoHand{"joints that turn about the fingers' own axes",
                           robot_text(joint_text("a", "p", "l1", "0 0 .1", "0 0 1") +
                                      joint_text("b", "p", "l2", "0.02 0 .1", "0 0 1") +
                                      "<link name='t'/><joint name='f' type='fixed'><parent link='l1'/><child "
                                      "link='t'/><origin xyz='0 0 .08'/></joint>"),
                           "neither point nor close"}));

TEST(HandAnatomy, ASixthFingerIsLeftOut) {
  std::string body;
  for (int i = 0; i < 7; ++i) {
    const std::string n = std::to_string(i);
    body += joint_text("a" + n, "p", "l" + n, std::to_string(0.02 * i) + " 0 .1", "1 0 0") +
            joint_text("b" + n, "l" + n, "m" + n, "0 0 .05", "1 0 0");
  }
  const auto model = load_urdf(robot_text(body));
  ASSERT_TRUE(model.ok());
  const auto hand = find_hand_anatomy(*model);
  ASSERT_TRUE(hand.ok()) << hand.error().detail.c_str();
  EXPECT_EQ(hand->left_out.size(), 2U);
  EXPECT_EQ(hand->thumb_rule, ThumbRule::kFirst);
}

TEST(HandAnatomy, NamesDecideOnlyWhereGeometryDoesNot) {
  std::string body;
  for (const char* n : {"a", "b", "thumb"}) {
    const double x = n[0] == 'a' ? 0.0 : (n[0] == 'b' ? 0.02 : 0.04);
    body += joint_text(std::string("j") + n, "p", n, std::to_string(x) + " 0 .1", "1 0 0") +
            joint_text(std::string("k") + n, n, std::string("m") + n, "0 0 .05", "1 0 0");
  }
  const auto model = load_urdf(robot_text(body));
  ASSERT_TRUE(model.ok());
  const auto hand = find_hand_anatomy(*model);
  ASSERT_TRUE(hand.ok()) << hand.error().detail.c_str();
  EXPECT_EQ(hand->thumb_rule, ThumbRule::kName);
  EXPECT_EQ(model->links[hand->finger(Finger::kThumb)->last_link].name, "mthumb");
}

TEST(SerialFingers, AMotorsRangeKeepsItsFollowersWithinTheirs) {
  for (const char* name : {"mia", "barrett", "robotiq_2f140", "shadow"}) {
    const RobotModel model = test::shipped_model(name);
    for (std::size_t m = 0; m < model.joints.size(); ++m) {
      if (model.joints[m].type == JointType::kFixed || model.joints[m].mimic) continue;
      const JointRange range = motor_range(model, m);
      for (const double r : {range.lower, range.upper}) {
        JointValues q = open_posture(model);
        q[m] = r;
        follow_mimics(model, q);
        for (std::size_t j = 0; j < model.joints.size(); ++j) {
          EXPECT_GE(q[j], model.joints[j].lower - 1e-9) << model.joints[j].name;
          EXPECT_LE(q[j], model.joints[j].upper + 1e-9) << model.joints[j].name;
        }
      }
    }
  }
}

TEST(SerialFingers, TheClosingVelocityIsTheDerivativeOfTheTip) {
  const RobotModel model = test::shipped_model("shadow");
  const auto hand = find_hand_anatomy(model);
  ASSERT_TRUE(hand.ok());
  const SerialFinger& index = *hand->finger(Finger::kIndex);
  constexpr double kStep = 1e-6;
  JointValues q = open_posture(model);
  const Vector3d before = link_poses(model, q)[index.tip_link] * index.p_tip_L;
  for (std::size_t i = index.knuckle; i < index.joints.size(); ++i) q[index.joints[i]] += kStep;
  const Vector3d after = link_poses(model, q)[index.tip_link] * index.p_tip_L;
  EXPECT_NEAR(((after - before) / kStep - index.v_closing_P).norm(), 0.0, 1e-6);
  EXPECT_NEAR((before - index.p_tip_P).norm(), 0.0, 1e-12);
}

}  // namespace
}  // namespace embody::robot
