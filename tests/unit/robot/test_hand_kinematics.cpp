#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/robot/hand_kinematics.hpp"
#include "tests/support/heap_counter.hpp"
#include "tests/unit/robot/mia_urdf.hpp"

namespace embody::robot {
namespace {

const std::vector<LinkPoint> kMiaPoints{
    {"thumb_fle", {0.03, 0.07, 0.0}},    {"thumb_fle", {0.03, 0.015, 0.0}},   {"index_fle", {-0.015, 0.09, 0.0}},
    {"index_fle", {0.02, 0.015, 0.0}},   {"middle_fle", {-0.015, 0.09, 0.0}}, {"middle_fle", {0.02, 0.015, 0.0}},
    {"ring_fle", {-0.012, 0.083, 0.0}},  {"ring_fle", {0.017, 0.015, 0.0}},   {"little_fle", {-0.01, 0.068, 0.0}},
    {"little_fle", {0.015, 0.015, 0.0}},
};

HandKinematicsSpec mia_spec(double opposition_rad, double zero_offset_rad = 0.0) {
  return {{"j_thumb_fle", "j_index_fle", "j_mrl_fle"},
          {{"j_thumb_opp", opposition_rad}},
          {{"j_index_fle", zero_offset_rad},
           {"j_mrl_fle", zero_offset_rad},
           {"j_ring_fle", zero_offset_rad},
           {"j_little_fle", zero_offset_rad}},
          kMiaPoints};
}

RobotModel load(const std::string& text) {
  Result<RobotModel> model = load_urdf(text);
  EXPECT_TRUE(model.ok()) << model.error().detail.c_str();
  return std::move(*model);
}

HandKinematics mia(double opposition_rad, double zero_offset_rad = 0.0) {
  Result<HandKinematics> hand =
      HandKinematics::create(load(test::mia_urdf()), mia_spec(opposition_rad, zero_offset_rad));
  EXPECT_TRUE(hand.ok()) << hand.error().detail.c_str();
  return std::move(*hand);
}

/// Points of all fingers with the three motors at the same angle.
std::vector<Eigen::Vector3d> points_at(const HandKinematics& hand, double angle_rad) {
  HandKinematics::Workspace workspace;
  hand.update(std::vector<double>(hand.motor_count(), angle_rad), workspace);
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < hand.point_count(); ++i) points.push_back(hand.point(i, workspace));
  return points;
}

void expect_points(const std::vector<Eigen::Vector3d>& points, const std::vector<Eigen::Vector3d>& expected) {
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_LE((points[i] - expected[i]).cwiseAbs().maxCoeff(), 1e-4) << "point " << i << ": " << points[i].transpose();
  }
}

TEST(MiaKinematics, ReachesTheIndependentlyComputedPointsWithTheThumbOpposed) {
  const HandKinematics hand = mia(0.0);
  expect_points(points_at(hand, 0.0), {{.0402, .0929, .0847},
                                       {.0336, .0594, .0416},
                                       {.0415, .1988, -.0371},
                                       {.0304, .1172, -.0452},
                                       {.0051, .2034, -.0400},
                                       {.0051, .1211, -.0482},
                                       {-.0268, .1928, -.0412},
                                       {-.0146, .1200, -.0450},
                                       {-.0511, .1687, -.0409},
                                       {-.0313, .1136, -.0406}});
  expect_points(points_at(hand, 1.0), {{.0067, .1423, .0426},
                                       {.0240, .0901, .0427},
                                       {.0269, .1726, .0451},
                                       {.0307, .1340, -.0280},
                                       {.0051, .1753, .0429},
                                       {.0051, .1377, -.0309},
                                       {-.0195, .1705, .0357},
                                       {-.0162, .1339, -.0284},
                                       {-.0431, .1577, .0236},
                                       {-.0351, .1267, -.0255}});
}

TEST(MiaKinematics, ReachesTheIndependentlyComputedPointsWithTheThumbLateral) {
  const HandKinematics hand = mia(-0.628319);
  expect_points(points_at(hand, 0.0), {{.0838, .1048, .0482}, {.0542, .0650, .0244}});
  expect_points(points_at(hand, 1.0), {{.0331, .1495, .0205}, {.0470, .0963, .0234}});
}

TEST(MiaKinematics, AnOffsetOfPlusAQuarterRadianGivesTheZeroOfTheVendorsUrdf) {
  // Roll, pitch, yaw of the four finger joints in the vendor's mia_hand_description.
  const std::vector<std::pair<std::string, Eigen::Vector3d>> vendor{
      {"j_index_fle", {-0.596919, 1.41555, -0.749807}},
      {"j_mrl_fle", {-1.57079, 1.48353, -1.57079}},
      {"j_ring_fle", {1.15081, 1.68124, 1.32178}},
      {"j_little_fle", {1.27834, 1.77592, 1.62719}},
  };
  const RobotModel model = load(test::mia_urdf());
  for (const auto& [name, rpy] : vendor) {
    const Eigen::Matrix3d R_vendor =
        (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
            .toRotationMatrix();
    const Eigen::Matrix3d R_ours = model.joints[*model.find_joint(name)].X_PC.linear();
    const Eigen::Vector3d rotation = math::log_so3(R_ours.transpose() * R_vendor);
    EXPECT_LE((rotation - Eigen::Vector3d(0.0, 0.0, 0.25)).norm(), 1e-4) << name << ": " << rotation.transpose();
  }
  const std::vector<Eigen::Vector3d> points = points_at(mia(0.0, 0.25), 0.0);
  EXPECT_LE((points[2] - Eigen::Vector3d(.0388, .2003, -.0145)).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LE((points[4] - Eigen::Vector3d(.0051, .2045, -.0172)).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(HandKinematics, JacobiansEqualFiniteDifferencesThroughCouplingsAndSlides) {
  // Root - revolute motor - mimic revolute (ratio -1.5) - slide motor - point, so that one column sums two joints.
  const std::string limit = "<limit lower='-3' upper='3' effort='1' velocity='1'/>";
  const RobotModel model = load(
      "<robot name='r'><link name='a'/><link name='b'/><link name='c'/><link name='d'/>"
      "<joint name='j1' type='revolute'><parent link='a'/><child link='b'/><origin xyz='0.1 0 0.2' rpy='0.3 0.2 0.1'/>"
      "<axis xyz='1 2 3'/>" +
      limit +
      "</joint><joint name='j2' type='revolute'><parent link='b'/><child link='c'/>"
      "<origin xyz='0 0.1 0'/><axis xyz='0 1 0'/>" +
      limit +
      "<mimic joint='j1' multiplier='-1.5' offset='0.2'/></joint>"
      "<joint name='j3' type='prismatic'><parent link='c'/><child link='d'/><origin rpy='0 1 0'/><axis xyz='0 0 1'/>" +
      limit + "</joint></robot>");
  const Result<HandKinematics> chain =
      HandKinematics::create(model, {{"j1", "j3"}, {}, {{"j2", 0.1}}, {{"d", {0.1, 0.2, 0.3}}}});
  ASSERT_TRUE(chain.ok()) << chain.error().detail.c_str();
  const HandKinematics hands[] = {*chain, mia(0.0), mia(-0.628319, 0.25)};
  constexpr unsigned kSeed = 3;
  RecordProperty("seed", static_cast<int>(kSeed));
  std::mt19937 engine(kSeed);
  std::uniform_real_distribution<double> uniform(-1.4, 1.4);
  constexpr double kStep = 1e-6;
  for (const HandKinematics& hand : hands) {
    for (int i = 0; i < 200; ++i) {
      std::vector<double> r(hand.motor_count());
      for (double& angle : r) angle = uniform(engine);
      HandKinematics::Workspace at, plus, minus;
      hand.update(r, at);
      for (std::size_t m = 0; m < r.size(); ++m) {
        std::vector<double> r_plus = r, r_minus = r;
        r_plus[m] += kStep;
        r_minus[m] -= kStep;
        hand.update(r_plus, plus);
        hand.update(r_minus, minus);
        for (std::size_t p = 0; p < hand.point_count(); ++p) {
          const Eigen::Vector3d slope = (hand.point(p, plus) - hand.point(p, minus)) / (2.0 * kStep);
          ASSERT_LE((slope - hand.jacobian(p, at).col(static_cast<int>(m))).norm(), 1e-8) << "point " << p;
        }
      }
    }
  }
}

TEST(HandKinematics, ReportsMimicAndFixedJointsLikeTheUrdfWithoutTheZeroOffset) {
  const HandKinematics hand = mia(-0.3, 0.25);
  std::vector<double> q(hand.model().joints.size());
  hand.joint_angles(std::vector<double>{0.1, 0.2, 0.3}, q);
  const auto angle = [&](const char* name) { return q[*hand.model().find_joint(name)]; };
  EXPECT_EQ(angle("j_thumb_fle"), 0.1);
  EXPECT_EQ(angle("j_index_fle"), 0.2);
  for (const char* name : {"j_mrl_fle", "j_ring_fle", "j_little_fle"}) EXPECT_EQ(angle(name), 0.3);
  EXPECT_EQ(angle("j_thumb_opp"), -0.3);
  EXPECT_EQ(angle("j_index_sensor"), 0.0);
}

TEST(HandKinematics, RefusesNamesThatDoNotFitTheUrdf) {
  const RobotModel model = load(test::mia_urdf());
  const auto error = [&](const HandKinematicsSpec& spec) {
    const Result<HandKinematics> hand = HandKinematics::create(model, spec);
    EXPECT_FALSE(hand.ok());
    return hand.ok() ? std::string() : std::string(hand.error().detail.view());
  };
  EXPECT_NE(error({{"j_toe"}, {}, {}, {}}).find("'j_toe'"), std::string::npos);
  EXPECT_NE(error({{"j_ring_fle"}, {}, {}, {}}).find("mimics"), std::string::npos);
  EXPECT_NE(error({{"j_index_sensor"}, {}, {}, {}}).find("fixed"), std::string::npos);
  EXPECT_NE(error({{"j_mrl_fle", "j_mrl_fle"}, {}, {}, {}}).find("twice"), std::string::npos);
  EXPECT_NE(error({{"j_mrl_fle"}, {{"j_mrl_fle", 0.0}}, {}, {}}).find("twice"), std::string::npos);
  EXPECT_NE(error({{"j_mrl_fle"}, {{"j_thumb_opp", NAN}}, {}, {}}).find("finite"), std::string::npos);
  EXPECT_NE(error({{"j_mrl_fle"}, {}, {{"j_toe", 0.1}}, {}}).find("'j_toe'"), std::string::npos);
  EXPECT_NE(error({{"j_mrl_fle"}, {}, {}, {{"toe", {0, 0, 0}}}}).find("'toe'"), std::string::npos);
  EXPECT_NE(error({{"j_mrl_fle"}, {}, {}, {{"palm", {0, NAN, 0}}}}).find("finite"), std::string::npos);
  EXPECT_NE(error({{"j_mrl_fle"}, {}, {}, std::vector<LinkPoint>(17, {"palm", {0, 0, 0}})}).find("16"),
            std::string::npos);
}

TEST(HandKinematics, NeverAllocatesAfterConstruction) {
  const HandKinematics hand = mia(0.0);
  const std::array<double, 3> r{0.1, 0.2, 0.3};
  HandKinematics::Workspace workspace;
  double sum = 0.0;
  const std::uint64_t before = test::heap_allocations();
  hand.update(r, workspace);
  for (std::size_t i = 0; i < hand.point_count(); ++i) sum += hand.jacobian(i, workspace).norm();
  EXPECT_EQ(test::heap_allocations(), before);
  EXPECT_GT(sum, 0.0);
}

}  // namespace
}  // namespace embody::robot
