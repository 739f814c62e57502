#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "core/robot/urdf_model.hpp"
#include "tests/unit/robot/mia_urdf.hpp"

namespace embody::robot {
namespace {

/// A robot of links a, b, c and two joints, with `joint_ab` inside the first.
std::string robot(const std::string& joint_ab, const std::string& type = "revolute", const std::string& extra = "") {
  return "<robot name='r'><link name='a'/><link name='b'/><link name='c'/><joint name='ab' type='" + type +
         "'><parent link='a'/><child link='b'/>" + joint_ab +
         "</joint><joint name='bc' type='fixed'><parent link='b'/><child link='c'/></joint>" + extra + "</robot>";
}

const std::string kLimit = "<limit lower='-1' upper='1' effort='1' velocity='1'/>";
const std::string kAxis = "<axis xyz='0 0 1'/>";

struct Broken {
  const char* title;
  std::string text;
  Errc code;
  const char* mentions;
};

void PrintTo(const Broken& broken, std::ostream* out) {
  *out << broken.title;
}

std::vector<Broken> broken_robots() {
  const std::string moving = kAxis + kLimit;
  const auto link = [](const std::string& name) { return "<link name='" + name + "'/>"; };
  const auto joint = [](const std::string& parent, const std::string& child) {
    return "<joint name='" + parent + child + "' type='fixed'><parent link='" + parent + "'/><child link='" + child +
           "'/></joint>";
  };
  std::string deep, many;
  for (int i = 0; i < 100'000; ++i) deep += "<x>";
  for (int i = 0; i < 100'000; ++i) many += "<x/>";
  return {
      {"empty text", "", Errc::kMalformed, "no element"},
      {"not XML", "hand: mia", Errc::kMalformed, "no element"},
      {"another document", "<html></html>", Errc::kMalformed, "<robot>"},
      {"cut off", "<robot name='r'><link name='a'/>", Errc::kMalformed, "ends before"},
      {"crossed tags", "<robot name='r'><link name='a'></robot></link>", Errc::kMalformed, "URDF"},
      {"an end tag too many", "</robot>", Errc::kMalformed, "line 1"},
      {"a document type", "<!DOCTYPE robot [<!ENTITY x 'y'>]><robot name='r'/>", Errc::kMalformed, "document type"},
      {"a NUL byte", std::string("<robot\0 name='r'/>", 18), Errc::kMalformed, "NUL"},
      {"deep nesting", "<robot name='r'>" + deep, Errc::kUnsupported, "64 deep"},
      {"deep nesting behind an end tag in a comment",
       "<robot name='r'>" +
           [] {
             std::string text;
             for (int i = 0; i < 1000; ++i) text += "<x><!-- </x> -->";
             return text;
           }(),
       Errc::kUnsupported, "64 deep"},
      {"too many elements", "<robot name='r'>" + many + "</robot>", Errc::kUnsupported, "elements"},
      {"a huge text", std::string(kMaxUrdfBytes + 1, ' '), Errc::kUnsupported, "bytes"},
      {"no link", "<robot name='r'></robot>", Errc::kMalformed, "URDF"},
      {"no robot name", "<robot><link name='a'/></robot>", Errc::kMalformed, "name"},
      {"a cycle", "<robot name='r'>" + link("a") + link("b") + joint("a", "b") + joint("b", "a") + "</robot>",
       Errc::kMalformed, "'a' is its own ancestor"},
      {"a cycle beside a tree",
       "<robot name='r'>" + link("a") + link("b") + link("c") + joint("b", "c") + joint("c", "b") + "</robot>",
       Errc::kMalformed, "its own ancestor"},
      {"two parents",
       "<robot name='r'>" + link("a") + link("b") + link("c") + joint("a", "c") + joint("b", "c") + "</robot>",
       Errc::kMalformed, "'c' is the child of two joints"},
      {"two roots", "<robot name='r'>" + link("a") + link("b") + "</robot>", Errc::kMalformed, "root"},
      {"a missing link", "<robot name='r'>" + link("a") + joint("a", "z") + "</robot>", Errc::kMalformed, "z"},
      {"no child", "<robot name='r'>" + link("a") + "<joint name='j' type='fixed'><parent link='a'/></joint></robot>",
       Errc::kMalformed, "'j' needs"},
      {"a zero axis", robot("<axis xyz='0 0 0'/>" + kLimit), Errc::kMalformed, "'ab' has an axis"},
      {"a missing limit", robot(kAxis), Errc::kMalformed, "ab"},
      {"lower above upper", robot(kAxis + "<limit lower='1' upper='-1' effort='1' velocity='1'/>"), Errc::kMalformed,
       "'ab' has a lower limit above"},
      {"a limit in degrees", robot(kAxis + "<limit lower='0' upper='900' effort='1' velocity='1'/>"), Errc::kMalformed,
       "URDF counts in radians"},
      {"a velocity below zero", robot(kAxis + "<limit lower='0' upper='1' effort='1' velocity='-1'/>"),
       Errc::kMalformed, "'ab' has an effort or velocity limit below zero"},
      {"a joint without a name",
       "<robot name='r'>" + link("a") + link("b") +
           "<joint name='' type='fixed'><parent link='a'/><child link='b'/></joint></robot>",
       Errc::kMalformed, "needs a name"},
      {"a NaN limit", robot(kAxis + "<limit lower='nan' upper='1' effort='1' velocity='1'/>"), Errc::kMalformed,
       "[ab]"},
      {"a limit without effort", robot(kAxis + "<limit lower='0' upper='1' velocity='1'/>"), Errc::kMalformed, "[ab]"},
      {"an infinite origin", robot(moving + "<origin xyz='inf 0 0'/>"), Errc::kMalformed, "[ab]"},
      {"a NaN rotation", robot(moving + "<origin rpy='0 nan 0'/>"), Errc::kMalformed, "[ab]"},
      {"an origin on the moon", robot(moving + "<origin xyz='3.8e8 0 0'/>"), Errc::kMalformed, "'ab' has an origin"},
      {"an overflowing axis", robot("<axis xyz='1e999 0 0'/>" + kLimit), Errc::kMalformed, "[ab]"},
      {"text for a number", robot("<axis xyz='x y z'/>" + kLimit), Errc::kMalformed, "[ab]"},
      {"a floating joint", robot("", "floating"), Errc::kUnsupported, "'ab' is floating"},
      {"an unknown type", robot("", "spherical"), Errc::kMalformed, "ab"},
      {"a mimic of nobody", robot(moving + "<mimic joint='ghost'/>"), Errc::kMalformed, "'ab' mimics 'ghost'"},
      {"a mimic of itself", robot(moving + "<mimic joint='ab'/>"), Errc::kMalformed, "mimics itself"},
      {"a mimic of a fixed joint", robot(moving + "<mimic joint='bc'/>"), Errc::kMalformed, "must both move"},
      {"mimics in a ring",
       "<robot name='r'>" + link("a") + link("b") + link("c") +
           "<joint name='j' type='continuous'><parent link='a'/><child link='b'/>" + kAxis +
           "<mimic joint='k'/></joint><joint name='k' type='continuous'><parent link='b'/><child link='c'/>" + kAxis +
           "<mimic joint='j'/></joint></robot>",
       Errc::kMalformed, "mimics itself"},
  };
}

class BrokenUrdf : public testing::TestWithParam<Broken> {};

TEST_P(BrokenUrdf, GivesOneSentenceThatNamesTheCulpritAndPrintsNothing) {
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  const Result<RobotModel> model = load_urdf(GetParam().text);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  ASSERT_FALSE(model.ok());
  const std::string sentence(model.error().detail.view());
  EXPECT_EQ(model.error().code, GetParam().code) << sentence;
  EXPECT_NE(sentence.find(GetParam().mentions), std::string::npos) << sentence;
  EXPECT_EQ(sentence.rfind("URDF: ", 0), 0U) << sentence;
  EXPECT_EQ(sentence.find('\n'), std::string::npos) << sentence;
}

INSTANTIATE_TEST_SUITE_P(Each, BrokenUrdf, testing::ValuesIn(broken_robots()));

TEST(UrdfModel, ReadsTheShippedMiaHandWithParentsBeforeChildren) {
  const Result<RobotModel> model = load_urdf(test::mia_urdf());
  ASSERT_TRUE(model.ok()) << model.error().detail.c_str();
  EXPECT_EQ(model->name, "mia");
  EXPECT_EQ(model->links.size(), 11U);
  ASSERT_EQ(model->joints.size(), 10U);
  EXPECT_EQ(model->links[0].name, "palm");
  EXPECT_EQ(model->links[0].parent_joint, kNoIndex);
  for (std::size_t i = 0; i < model->joints.size(); ++i) {
    const Joint& joint = model->joints[i];
    EXPECT_LT(joint.parent_link, joint.child_link) << joint.name;
    EXPECT_EQ(model->links[joint.child_link].parent_joint, i);
    EXPECT_EQ(model->find_joint(joint.name), i);
    EXPECT_TRUE(math::is_valid(joint.X_PC)) << joint.name;
  }
  const Joint& ring = model->joints[*model->find_joint("j_ring_fle")];
  ASSERT_TRUE(ring.mimic.has_value());
  EXPECT_EQ(model->joints[ring.mimic->joint].name, "j_mrl_fle");
  EXPECT_EQ(ring.mimic->multiplier, 1.0);
  EXPECT_EQ(model->joints[*model->find_joint("j_thumb_fle")].upper, 1.1345);
  EXPECT_EQ(model->joints[*model->find_joint("j_index_fle")].lower, -1.4);
  EXPECT_EQ(model->joints[*model->find_joint("j_index_fle")].max_velocity, 3.14);
  EXPECT_FALSE(model->find_link("sixth_finger").has_value());
}

TEST(UrdfModel, NormalisesAxesAndLeavesContinuousJointsUnbounded) {
  const Result<RobotModel> model = load_urdf(robot("<axis xyz='0 3 4'/>", "continuous"));
  ASSERT_TRUE(model.ok()) << model.error().detail.c_str();
  const Joint& joint = model->joints[0];
  EXPECT_NEAR((joint.axis - Eigen::Vector3d(0.0, 0.6, 0.8)).norm(), 0.0, 1e-15);
  EXPECT_TRUE(std::isinf(joint.lower) && std::isinf(joint.upper));
}

TEST(UrdfModel, FollowsChainsOfMimicsToTheIndependentJoint) {
  const std::string joint_k = "<joint name='k' type='revolute'><parent link='c'/><child link='d'/>" + kAxis + kLimit +
                              "<mimic joint='ab' multiplier='2' offset='0.5'/></joint>";
  const std::string joint_m = "<joint name='m' type='revolute'><parent link='d'/><child link='e'/>" + kAxis + kLimit +
                              "<mimic joint='k' multiplier='-3' offset='0.25'/></joint>";
  const Result<RobotModel> model =
      load_urdf(robot(kAxis + kLimit, "revolute", "<link name='d'/><link name='e'/>" + joint_k + joint_m));
  ASSERT_TRUE(model.ok()) << model.error().detail.c_str();
  const Joint& m = model->joints[*model->find_joint("m")];
  EXPECT_EQ(m.mimic->joint, *model->find_joint("ab"));
  EXPECT_DOUBLE_EQ(m.mimic->multiplier, -6.0);
  EXPECT_DOUBLE_EQ(m.mimic->offset, -3.0 * 0.5 + 0.25);
}

TEST(UrdfModel, SurvivesRandomDamage) {
  const std::string original = test::mia_urdf();
  constexpr unsigned kSeed = 5;
  RecordProperty("seed", static_cast<int>(kSeed));
  std::mt19937 engine(kSeed);
  const std::string alphabet = "<>/='\"!-?0159.e abxyz\n";
  int loaded = 0;
  for (int i = 0; i < 3'000; ++i) {
    std::string text = original;
    const int edits = 1 + static_cast<int>(engine() % 4);
    for (int k = 0; k < edits; ++k) {
      const std::size_t at = engine() % text.size();
      switch (engine() % 4) {
        case 0:
          text[at] = alphabet[engine() % alphabet.size()];
          break;
        case 1:
          text.erase(at, engine() % 200);
          break;
        case 2:
          text.insert(at, original.substr(engine() % original.size(), engine() % 200));
          break;
        default:
          text.resize(at + 1);
      }
    }
    const Result<RobotModel> model = load_urdf(text);
    if (!model) {
      ASSERT_FALSE(model.error().detail.empty());
      continue;
    }
    ++loaded;
    for (const Joint& joint : model->joints) {
      ASSERT_TRUE(math::is_valid(joint.X_PC) && joint.lower <= joint.upper && joint.parent_link < joint.child_link);
      ASSERT_TRUE(!joint.mimic || !model->joints[joint.mimic->joint].mimic);
    }
  }
  EXPECT_GT(loaded, 100);  // otherwise the damage is too great to say anything
}

}  // namespace
}  // namespace embody::robot
