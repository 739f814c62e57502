#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>
#include <tuple>

#include "tests/unit/math/random_values.hpp"
#include "tests/unit/robot/hand_files.hpp"

// The shipped robot hands against figures that were computed independently of them (rounded to 1e-4 m), and against
// what must hold for any hand that follows a human one.
namespace embody {
namespace {

using Eigen::Vector3d;
using robot::JointType;
using robot::RobotModel;
using Angles = std::map<std::string, double>;

constexpr double kHalfPi = std::numbers::pi / 2;

// ---- known points ---------------------------------------------------------------------------------------------------

/// A point of a link, the link's own origin if p_L is zero.
struct KnownPoint {
  const char* link;
  Vector3d p_L;
  Vector3d p_P;
};

void expect_points(const std::string& hand, const Angles& angles, const std::vector<KnownPoint>& points) {
  const RobotModel model = test::hand_model(hand);
  const std::vector<double> q = test::joint_angles(model, angles);
  for (const KnownPoint& known : points) {
    const Vector3d p_P = test::point_P(model, q, known.link, known.p_L);
    EXPECT_LE((p_P - known.p_P).cwiseAbs().maxCoeff(), 1e-4) << hand << " " << known.link << ": " << p_P.transpose();
  }
}

const Vector3d kOrigin = Vector3d::Zero();

TEST(MiaModel, ThumbReachesTheKnownPointsOpposedAndLateral) {
  const Vector3d tip{0.03, 0.07, 0.0}, middle{0.03, 0.015, 0.0};
  expect_points("mia", {},
                {{"thumb_fle", kOrigin, {0.0184, 0.0724, 0.0147}},
                 {"thumb_fle", tip, {0.0402, 0.0929, 0.0847}},
                 {"thumb_fle", middle, {0.0336, 0.0594, 0.0416}}});
  expect_points("mia", {{"j_thumb_fle", 1.0}},
                {{"thumb_fle", tip, {0.0067, 0.1423, 0.0426}}, {"thumb_fle", middle, {0.0240, 0.0901, 0.0427}}});
  expect_points("mia", {{"j_thumb_opp", -0.628}},
                {{"thumb_fle", kOrigin, {0.0267, 0.0747, 0.0077}},
                 {"thumb_fle", tip, {0.0838, 0.1048, 0.0482}},
                 {"thumb_fle", middle, {0.0542, 0.0650, 0.0244}}});
  expect_points("mia", {{"j_thumb_opp", -0.628}, {"j_thumb_fle", 1.0}},
                {{"thumb_fle", tip, {0.0331, 0.1495, 0.0205}}, {"thumb_fle", middle, {0.0470, 0.0963, 0.0234}}});
}

TEST(MiaModel, FingersReachTheKnownPoints) {
  const Vector3d tip{-0.015, 0.09, 0.0}, middle{0.02, 0.015, 0.0};
  expect_points("mia", {},
                {{"index_fle", tip, {0.0415, 0.1988, -0.0371}},
                 {"index_fle", middle, {0.0304, 0.1172, -0.0452}},
                 {"middle_fle", tip, {0.0051, 0.2034, -0.0400}},
                 {"middle_fle", middle, {0.0051, 0.1211, -0.0482}},
                 {"ring_fle", {-0.012, 0.083, 0.0}, {-0.0268, 0.1928, -0.0412}},
                 {"ring_fle", {0.017, 0.015, 0.0}, {-0.0146, 0.1200, -0.0450}},
                 {"little_fle", {-0.01, 0.068, 0.0}, {-0.0511, 0.1687, -0.0409}},
                 {"little_fle", {0.015, 0.015, 0.0}, {-0.0313, 0.1136, -0.0406}}});
  expect_points("mia", {{"j_index_fle", 1.0}, {"j_mrl_fle", 1.0}},
                {{"index_fle", tip, {0.0269, 0.1726, 0.0451}},
                 {"index_fle", middle, {0.0307, 0.1340, -0.0280}},
                 {"middle_fle", tip, {0.0051, 0.1753, 0.0429}},
                 {"middle_fle", middle, {0.0051, 0.1377, -0.0309}},
                 {"ring_fle", {-0.012, 0.083, 0.0}, {-0.0195, 0.1705, 0.0357}},
                 {"ring_fle", {0.017, 0.015, 0.0}, {-0.0162, 0.1339, -0.0284}},
                 {"little_fle", {-0.01, 0.068, 0.0}, {-0.0431, 0.1577, 0.0236}},
                 {"little_fle", {0.015, 0.015, 0.0}, {-0.0351, 0.1267, -0.0255}}});
  // The vendor's own zero pose is a quarter of a radian further bent (docs/mia_hand_model.md).
  expect_points("mia", {{"j_index_fle", 0.25}, {"j_mrl_fle", 0.25}},
                {{"index_fle", tip, {0.0388, 0.2003, -0.0145}}, {"middle_fle", tip, {0.0051, 0.2045, -0.0172}}});
}

TEST(ShadowModel, ReachesTheKnownPointsOfTheFlatHand) {
  expect_points("shadow", {},
                {{"rh_ffknuckle", kOrigin, {0.033, -0.010, 0.342}},
                 {"rh_mfknuckle", kOrigin, {0.011, -0.010, 0.346}},
                 {"rh_rfknuckle", kOrigin, {-0.011, -0.010, 0.342}},
                 {"rh_lfknuckle", kOrigin, {-0.033, -0.010, 0.3335}},
                 {"rh_fftip", {0, 0.01, 0}, {0.033, 0, 0.438}},
                 {"rh_mftip", {0, 0.01, 0}, {0.011, 0, 0.442}},
                 {"rh_rftip", {0, 0.01, 0}, {-0.011, 0, 0.438}},
                 {"rh_lftip", {0, 0.01, 0}, {-0.033, 0, 0.4295}},
                 {"rh_thtip", {0, 0.013, 0}, {0.1121, -0.0185, 0.3358}},
                 {"rh_ffproximal", {0, 0.015, 0.02}, {0.033, 0.005, 0.362}},
                 {"rh_mfproximal", {0, 0.015, 0.02}, {0.011, 0.005, 0.366}},
                 {"rh_rfproximal", {0, 0.015, 0.02}, {-0.011, 0.005, 0.362}},
                 {"rh_lfproximal", {0, 0.015, 0.02}, {-0.033, 0.005, 0.3535}},
                 {"rh_thmiddle", {0.015, 0, 0.015}, {0.0821, -0.0185, 0.3029}}});
}

TEST(RobotiqModel, ReachesTheKnownPointsOpenHalfAndClosed) {
  struct Row {
    double q, pad_y, pad_z, tip_y, tip_z, middle_y, middle_z;
  };
  for (const Row& row : {Row{0.0, -0.0680, 0.1770, -0.0780, 0.2070, -0.0852, 0.1512},
                         Row{0.35, -0.0379, 0.1945, -0.0479, 0.2245, -0.0552, 0.1687},
                         Row{0.7, -0.0037, 0.2007, -0.0137, 0.2307, -0.0209, 0.1749}}) {
    expect_points("robotiq_2f140", {{"finger_joint", row.q}},
                  {{"left_inner_finger_pad", kOrigin, {0, row.pad_y, row.pad_z}},
                   {"left_inner_finger_pad", {0, 0.03, 0.01}, {0, row.tip_y, row.tip_z}},
                   {"left_inner_finger", {0, 0.02, -0.01}, {0, row.middle_y, row.middle_z}},
                   {"right_inner_finger_pad", kOrigin, {0, -row.pad_y, row.pad_z}},
                   {"right_inner_finger_pad", {0, 0.03, 0.01}, {0, -row.tip_y, row.tip_z}},
                   {"right_inner_finger", {0, 0.02, -0.01}, {0, -row.middle_y, row.middle_z}}});
  }
}

TEST(BarrettModel, ReachesTheKnownPoints) {
  const Vector3d tip{-0.045, 0.027, 0.0}, middle{-0.01, -0.01, 0.0}, thumb_tip{-0.015, -0.005, 0.0};
  expect_points("barrett", {},
                {{"finger_1_dist_link", tip, {0.025, 0.1649, 0.1054}},
                 {"finger_1_dist_link", middle, {0.025, 0.1299, 0.0684}},
                 {"finger_2_dist_link", thumb_tip, {-0.025, 0.1349, 0.0738}},
                 {"finger_2_med_link", {-0.05, -0.012, 0.0}, {-0.025, 0.1000, 0.0634}},
                 {"finger_3_dist_link", tip, {0, -0.1649, 0.1054}},
                 {"finger_3_dist_link", middle, {0, -0.1299, 0.0684}}});
  // A third of -1.2 is -0.4: the known pose has the coupling that the model has.
  expect_points("barrett", {{"finger_1_med_joint", -1.2}, {"finger_2_med_joint", -1.2}, {"finger_3_med_joint", -1.2}},
                {{"finger_1_dist_link", tip, {0.025, 0.0442, 0.1859}},
                 {"finger_2_dist_link", thumb_tip, {-0.025, 0.0767, 0.1569}},
                 {"finger_3_dist_link", tip, {0, -0.0442, 0.1859}}});
  expect_points(
      "barrett", {{"finger_2_prox_joint", kHalfPi}},
      {{"finger_1_dist_link", tip, {0.1899, 0, 0.1054}}, {"finger_2_dist_link", thumb_tip, {-0.1599, 0, 0.0738}}});
}

// ---- limits and couplings ---------------------------------------------------------------------------------------

using Limits = std::map<std::string, std::pair<double, double>>;

Limits shadow_limits() {
  Limits limits{{"rh_WRJ2", {-0.523599, 0.174533}}, {"rh_WRJ1", {-0.698132, 0.488692}},
                {"rh_LFJ5", {0, 0.785398}},         {"rh_THJ5", {-1.047198, 1.047198}},
                {"rh_THJ4", {0, 1.22173}},          {"rh_THJ3", {-0.20944, 0.20944}},
                {"rh_THJ2", {-0.698132, 0.698132}}, {"rh_THJ1", {-0.261799, 1.570796}}};
  for (const std::string finger : {"rh_FF", "rh_MF", "rh_RF", "rh_LF"}) {
    limits[finger + "J4"] = {-0.349066, 0.349066};
    limits[finger + "J3"] = {-0.261799, 1.570796};
    limits[finger + "J2"] = limits[finger + "J1"] = {0, 1.570796};
  }
  return limits;
}

TEST(HandModels, HaveTheKnownLimitsAndNoOtherMovingJoints) {
  const std::map<std::string, Limits> known{{"mia",
                                             {{"j_index_fle", {-1.4, 1.4}},
                                              {"j_mrl_fle", {0, 1.39626}},
                                              {"j_ring_fle", {0, 1.39626}},
                                              {"j_little_fle", {0, 1.39626}},
                                              {"j_thumb_fle", {0, 1.1345}},
                                              {"j_thumb_opp", {-0.628319, 0}}}},
                                            {"shadow", shadow_limits()},
                                            {"robotiq_2f140",
                                             {{"finger_joint", {0, 0.7}},
                                              {"right_outer_knuckle_joint", {-0.725, 0.725}},
                                              {"left_inner_knuckle_joint", {-0.8757, 0.8757}},
                                              {"right_inner_knuckle_joint", {-0.8757, 0.8757}},
                                              {"left_inner_finger_joint", {-0.8757, 0.8757}},
                                              {"right_inner_finger_joint", {-0.8757, 0.8757}}}},
                                            {"barrett",
                                             {{"finger_1_prox_joint", {-3.141, 0}},
                                              {"finger_2_prox_joint", {0, 3.141}},
                                              {"finger_1_med_joint", {-2.44, 0}},
                                              {"finger_2_med_joint", {-2.44, 0}},
                                              {"finger_3_med_joint", {-2.44, 0}},
                                              {"finger_1_dist_joint", {-0.785, 0}},
                                              {"finger_2_dist_joint", {-0.785, 0}},
                                              {"finger_3_dist_joint", {-0.785, 0}}}}};
  for (const auto& [hand, limits] : known) {
    const RobotModel model = test::hand_model(hand);
    std::size_t moving = 0;
    for (const robot::Joint& joint : model.joints) {
      if (joint.type == JointType::kFixed) continue;
      ++moving;
      const auto entry = limits.find(joint.name);
      ASSERT_NE(entry, limits.end()) << hand << " " << joint.name;
      EXPECT_EQ(joint.lower, entry->second.first) << hand << " " << joint.name;
      EXPECT_EQ(joint.upper, entry->second.second) << hand << " " << joint.name;
      EXPECT_GT(joint.max_velocity, 0.0) << hand << " " << joint.name;
      EXPECT_GT(joint.max_effort, 0.0) << hand << " " << joint.name;
      EXPECT_LE(joint.max_effort, 30.0) << hand << " " << joint.name;
    }
    EXPECT_EQ(moving, limits.size()) << hand;
  }
}

TEST(HandModels, HaveTheKnownMimics) {
  using Row = std::tuple<std::string, std::string, std::string, double>;  // hand, joint, mimicked joint, multiplier
  const std::set<Row> known{{"mia", "j_ring_fle", "j_mrl_fle", 1},
                            {"mia", "j_little_fle", "j_mrl_fle", 1},
                            {"robotiq_2f140", "right_outer_knuckle_joint", "finger_joint", -1},
                            {"robotiq_2f140", "left_inner_knuckle_joint", "finger_joint", -1},
                            {"robotiq_2f140", "right_inner_knuckle_joint", "finger_joint", -1},
                            {"robotiq_2f140", "left_inner_finger_joint", "finger_joint", 1},
                            {"robotiq_2f140", "right_inner_finger_joint", "finger_joint", 1},
                            {"barrett", "finger_1_prox_joint", "finger_2_prox_joint", -1},
                            {"barrett", "finger_1_dist_joint", "finger_1_med_joint", 0.3333333333},
                            {"barrett", "finger_2_dist_joint", "finger_2_med_joint", 0.3333333333},
                            {"barrett", "finger_3_dist_joint", "finger_3_med_joint", 0.3333333333}};
  std::set<Row> found;
  for (const std::string hand : test::kHandFiles) {
    const RobotModel model = test::hand_model(hand);
    for (const robot::Joint& joint : model.joints) {
      if (!joint.mimic) continue;
      EXPECT_EQ(joint.mimic->offset, 0.0) << joint.name;
      found.emplace(hand, joint.name, model.joints[joint.mimic->joint].name, joint.mimic->multiplier);
    }
  }
  EXPECT_EQ(found, known);
}

/// Every motor at a random place of its range.
std::vector<double> random_motors(const EmbodimentConfig& config, test::RandomValues& random) {
  std::vector<double> r;
  for (std::size_t i = 0; i < config.motors.size(); ++i) {
    r.push_back(random(config.motor_lower_rad[i], config.motor_upper_rad[i]));
  }
  return r;
}

TEST(HandModels, KeepEveryJointWithinItsLimitsOverTheWholeRangeOfTheMotors) {
  for (const std::string hand : test::kHandFiles) {
    const RobotModel model = test::hand_model(hand);
    const EmbodimentConfig config = test::hand_config(hand);
    test::RandomValues random(7);
    for (int n = 0; n < 300; ++n) {
      std::vector<double> r = random_motors(config, random);
      if (n == 0) r = config.motor_lower_rad;
      if (n == 1) r = config.motor_upper_rad;
      const std::vector<double> q = test::motor_angles(model, config, r);
      for (std::size_t i = 0; i < q.size(); ++i) {
        if (model.joints[i].type == JointType::kFixed) continue;
        ASSERT_GE(q[i], model.joints[i].lower - 1e-9) << hand << " " << model.joints[i].name;
        ASSERT_LE(q[i], model.joints[i].upper + 1e-9) << hand << " " << model.joints[i].name;
      }
    }
  }
}

TEST(ShadowModel, AFingersJ0BendsTheMiddleJointFirstAndTheDistalJointAfterIt) {
  const RobotModel model = test::hand_model("shadow");
  const EmbodimentConfig config = test::hand_config("shadow");
  EXPECT_EQ(config.motors.size(), 18U);
  EXPECT_EQ(config.couplings.size(), 8U);
  test::RandomValues random(11);
  for (int n = 0; n < 200; ++n) {
    const std::vector<double> r = random_motors(config, random);
    const std::vector<double> q = test::motor_angles(model, config, r);
    for (const std::string finger : {"rh_FF", "rh_MF", "rh_RF", "rh_LF"}) {
      const auto motor = std::find(config.motors.begin(), config.motors.end(), finger + "J0");
      ASSERT_NE(motor, config.motors.end());
      const double j0 = r[static_cast<std::size_t>(motor - config.motors.begin())];
      const double j2 = q[model.find_joint(finger + "J2").value()], j1 = q[model.find_joint(finger + "J1").value()];
      EXPECT_NEAR(j2, std::min(j0, kHalfPi), 1e-6);
      EXPECT_NEAR(j1, j0 - j2, 1e-6);
    }
  }
}

TEST(ShadowModel, AbductionGathersTheFingersAroundTheMiddleFingerAndFlexionGoesToThePalm) {
  const RobotModel model = test::hand_model("shadow");
  const std::vector<double> flat = test::joint_angles(model, {});
  for (const auto& [finger, towards_x] : {std::pair{"ff", -1.0}, {"mf", -1.0}, {"rf", 1.0}, {"lf", 1.0}}) {
    std::string upper = finger;
    for (char& c : upper) c = static_cast<char>(std::toupper(c));
    const std::string tip = "rh_" + std::string(finger) + "tip";
    const Vector3d p_P = test::point_P(model, flat, tip, kOrigin);
    const auto moved = [&](const std::string& joint) {
      return (test::point_P(model, test::joint_angles(model, {{"rh_" + upper + joint, 0.2}}), tip, kOrigin) - p_P)
          .eval();
    };
    EXPECT_GT(moved("J4").x() * towards_x, 0.015) << finger;
    for (const char* joint : {"J3", "J2", "J1"}) EXPECT_LT(moved(joint).y(), -0.004) << finger << joint;
  }
}

TEST(RobotiqModel, KeepsItsPadsParallelAndTheLinkageClosed) {
  const RobotModel model = test::hand_model("robotiq_2f140");
  test::RandomValues random(13);
  for (int n = 0; n < 100; ++n) {
    const double q = random(0.0, 0.7);
    const std::vector<Pose> X_PL = test::link_poses(model, test::joint_angles(model, {{"finger_joint", q}}));
    for (const auto& [side, outward_y] : {std::pair{"left", -1.0}, {"right", 1.0}}) {
      const Pose& X_PF = X_PL[model.find_link(std::string(side) + "_inner_finger").value()];
      const Pose& X_PK = X_PL[model.find_link(std::string(side) + "_inner_knuckle").value()];
      const Eigen::Matrix3d R_PF = X_PF.linear();
      EXPECT_LE((R_PF.col(1) - Vector3d::UnitZ()).norm(), 2e-6) << side << " at " << q;
      EXPECT_LE((R_PF.col(2) - outward_y * Vector3d::UnitY()).norm(), 2e-6) << side << " at " << q;
      // Where the inner knuckle carries the finger: the same place of both links at every angle.
      const Vector3d p_P = X_PK * Vector3d(0.0, 0.09997531, -0.00221799);
      const Vector3d p_F = X_PF.inverse() * p_P;
      EXPECT_LE((p_F - Vector3d(0.0, 0.006515, -0.017901)).cwiseAbs().maxCoeff(), 5e-5) << p_F.transpose();
    }
  }
}

TEST(BarrettModel, SpreadsFingers1And2AsMirrorImages) {
  const RobotModel model = test::hand_model("barrett");
  test::RandomValues random(17);
  for (int n = 0; n < 100; ++n) {
    const double med = random(-2.355, 0.0);
    const std::vector<double> q = test::joint_angles(
        model, {{"finger_2_prox_joint", random(0.0, 3.141)}, {"finger_1_med_joint", med}, {"finger_2_med_joint", med}});
    const Vector3d one = test::point_P(model, q, "finger_1_med_link", {-0.06, 0.0, 0.0});
    const Vector3d two = test::point_P(model, q, "finger_2_med_link", {-0.06, 0.0, 0.0});
    EXPECT_LE((one - Vector3d(-two.x(), two.y(), two.z())).norm(), 1e-6);
  }
}

// ---- the TOML files -------------------------------------------------------------------------------------------------

TEST(HandFiles, NameOnlyLinksAndJointsThatTheUrdfHas) {
  for (const std::string hand : test::kHandFiles) {
    const RobotModel model = test::hand_model(hand);
    const EmbodimentConfig config = test::hand_config(hand);
    EXPECT_EQ(config.urdf, hand + ".urdf");
    EXPECT_EQ(config.name, hand);
    EXPECT_EQ(config.root_link, model.links[0].name);
    ASSERT_EQ(config.motor_lower_rad.size(), config.motors.size());
    ASSERT_EQ(config.motor_upper_rad.size(), config.motors.size());
    std::set<std::string> coupled;
    for (const JointCoupling& coupling : config.couplings) {
      coupled.insert(coupling.motor);
      EXPECT_TRUE(model.find_joint(coupling.joint)) << hand << " " << coupling.joint;
      EXPECT_NE(std::find(config.motors.begin(), config.motors.end(), coupling.motor), config.motors.end());
      EXPECT_EQ(coupling.motor_rad.size(), coupling.joint_rad.size());
    }
    for (std::size_t i = 0; i < config.motors.size(); ++i) {
      const auto joint = model.find_joint(config.motors[i]);
      EXPECT_TRUE(joint || coupled.count(config.motors[i]) == 1) << hand << " " << config.motors[i];
      EXPECT_FALSE(joint && model.joints[*joint].mimic) << hand << " " << config.motors[i];
      EXPECT_LT(config.motor_lower_rad[i], config.motor_upper_rad[i]) << hand << " " << config.motors[i];
    }
    for (const FingerPoints& finger : config.fingers) {
      if (finger.link.empty()) continue;
      EXPECT_TRUE(model.find_link(finger.link)) << hand << " " << finger.link;
      EXPECT_TRUE(finger.middle_link.empty() || model.find_link(finger.middle_link)) << hand << finger.middle_link;
      EXPECT_FALSE(finger.pads.empty()) << hand << " " << finger.link;
      for (const ContactPad& pad : finger.pads) EXPECT_TRUE(model.find_link(pad.link)) << hand << " " << pad.link;
    }
  }
}

TEST(HandFiles, HaveTheKnownPosesOfTheHumanHand) {
  const std::map<std::string, std::pair<Vector3d, Eigen::Quaterniond>> known{
      {"mia", {{-0.00938, 0.11752, -0.03176}, {-0.464867, 0.409585, -0.352178, 0.701505}}},
      {"shadow", {{0.01289, -0.00090, 0.36013}, {0.630361, -0.030571, 0.773002, -0.064635}}},
      {"robotiq_2f140", {{-0.03801, 0.03622, 0.14095}, {0.646190, -0.065047, 0.654429, -0.387208}}},
      {"barrett", {{0.02032, -0.06167, 0.11421}, {-0.350340, 0.686909, 0.231672, -0.593082}}}};
  for (const auto& [hand, pose] : known) {
    const Pose X_PM = math::exp_se3(test::hand_config(hand).X_PM);
    EXPECT_LE((X_PM.translation() - pose.first).cwiseAbs().maxCoeff(), 1e-5) << hand;
    EXPECT_LE(math::angle_between(X_PM.linear(), pose.second.normalized().toRotationMatrix()), 1e-5) << hand;
  }
}

/// Chain of links from the root to `link`, root first.
std::vector<std::size_t> chain_to(const RobotModel& model, std::size_t link) {
  std::vector<std::size_t> chain{link};
  while (model.links[chain.front()].parent_joint != robot::kNoIndex) {
    chain.insert(chain.begin(), model.joints[model.links[chain.front()].parent_joint].parent_link);
  }
  return chain;
}

TEST(HandFiles, HavePadsOnTheFingerThatLookAwayFromTheBackOfIt) {
  for (const std::string hand : test::kHandFiles) {
    const RobotModel model = test::hand_model(hand);
    const EmbodimentConfig config = test::hand_config(hand);
    const std::vector<double> q = test::joint_angles(model, {});
    const std::vector<Pose> X_PL = test::link_poses(model, q);
    for (const FingerPoints& finger : config.fingers) {
      if (finger.link.empty()) continue;
      const std::size_t tip_link = model.find_link(finger.link).value();
      const std::vector<std::size_t> chain = chain_to(model, tip_link);
      for (const ContactPad& pad : finger.pads) {
        const std::size_t link = model.find_link(pad.link).value();
        EXPECT_NE(std::find(chain.begin(), chain.end(), link), chain.end()) << hand << " " << pad.link;
        EXPECT_NEAR(pad.facing.norm(), 1.0, 1e-5) << hand << " " << pad.link;
        EXPECT_NEAR(pad.facing.dot((pad.to_m - pad.from_m).normalized()), 0.0, 1e-5) << hand << " " << pad.link;
        EXPECT_GT(pad.radius_m, 0.003) << hand << " " << pad.link;
        // `to` is nearer to the tip than `from`, seen from the finger's first moving joint.
        const Vector3d base = X_PL[chain[1]].translation();
        EXPECT_GT((X_PL[link] * pad.to_m - base).norm(), (X_PL[link] * pad.from_m - base).norm()) << hand << pad.link;
      }
      // Markers sit on the back of the finger: the point that follows one is behind the first pad.
      const ContactPad& pad = finger.pads.front();
      const Vector3d tip_pad = X_PL[model.find_link(pad.link).value()].inverse() * X_PL[tip_link] * finger.tip_m;
      EXPECT_LT((tip_pad - pad.from_m).dot(pad.facing), 0.0) << hand << " " << pad.link;
    }
  }
}

TEST(HandFiles, HaveFirstPadsThatMoveWhereTheyLookWhenTheFingerCloses) {
  const std::map<std::string, std::vector<std::tuple<Finger, std::string, double>>> closing{
      {"mia",
       {{Finger::kThumb, "j_thumb_fle", 1.0},
        {Finger::kIndex, "j_index_fle", 1.0},
        {Finger::kMiddle, "j_mrl_fle", 1.0},
        {Finger::kRing, "j_mrl_fle", 1.0},
        {Finger::kLittle, "j_mrl_fle", 1.0}}},
      {"shadow",
       {{Finger::kThumb, "rh_THJ1", 1.0},
        {Finger::kIndex, "rh_FFJ0", 1.0},
        {Finger::kMiddle, "rh_MFJ0", 1.0},
        {Finger::kRing, "rh_RFJ0", 1.0},
        {Finger::kLittle, "rh_LFJ0", 1.0},
        {Finger::kIndex, "rh_FFJ3", 1.0},
        {Finger::kLittle, "rh_LFJ3", 1.0}}},
      {"robotiq_2f140", {{Finger::kThumb, "finger_joint", 1.0}, {Finger::kIndex, "finger_joint", 1.0}}},
      {"barrett",
       {{Finger::kThumb, "finger_2_med_joint", -1.0},
        {Finger::kIndex, "finger_3_med_joint", -1.0},
        {Finger::kMiddle, "finger_1_med_joint", -1.0}}}};
  for (const auto& [hand, rows] : closing) {
    const RobotModel model = test::hand_model(hand);
    const EmbodimentConfig config = test::hand_config(hand);
    for (const auto& [finger, motor, sign] : rows) {
      const ContactPad& pad = config.fingers[static_cast<std::size_t>(finger)].pads.front();
      const auto at = static_cast<std::size_t>(std::find(config.motors.begin(), config.motors.end(), motor) -
                                               config.motors.begin());
      ASSERT_LT(at, config.motors.size()) << hand << " " << motor;
      for (const double start : {0.1, 0.5}) {
        std::vector<double> r(config.motors.size(), 0.0);
        const auto pose = [&](double angle) {
          r[at] = sign * angle;
          return test::link_poses(model, test::motor_angles(model, config, r))[model.find_link(pad.link).value()];
        };
        const Pose X_before = pose(start), X_after = pose(start + 0.01);
        const Vector3d centre = 0.5 * (pad.from_m + pad.to_m);
        const Vector3d motion = X_after * centre - X_before * centre;
        EXPECT_GT(motion.dot(X_before.linear() * pad.facing), 0.6 * motion.norm()) << hand << " " << motor;
        EXPECT_GT(motion.norm(), 1e-4) << hand << " " << motor;
      }
    }
  }
}

}  // namespace
}  // namespace embody
