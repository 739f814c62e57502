#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/embodiment/embodiment_mapping.hpp"
#include "tests/support/heap_counter.hpp"
#include "tests/unit/embodiment/mia_config.hpp"

namespace embody {
namespace {

using Points = std::array<std::array<Eigen::Vector3d, 2>, kFingers>;

EmbodimentMapping make(const EmbodimentConfig& config, const robot::RobotModel& model = test::mia_model()) {
  Result<EmbodimentMapping> mapping = EmbodimentMapping::create(model, config);
  EXPECT_TRUE(mapping.ok()) << mapping.error().detail.c_str();
  return std::move(*mapping);
}

/// A hand state whose points are `p_P` seen from the robot hand.
HandState state_of(const EmbodimentMapping& mapping, const Points& p_P) {
  HandState state;
  state.valid = true;
  state.quality.fill(FingerQuality::kOptimal);
  state.confidence.fill(1.0);
  for (std::size_t f = 0; f < kFingers; ++f) {
    for (std::size_t i = 0; i < 2; ++i) state.p_M[f][i] = mapping.X_PM().inverse() * p_P[f][i];
  }
  return state;
}

bool has(const EmbodimentConfig& config, std::size_t finger) {
  return !config.fingers[finger].link.empty();
}

/// Sum of squared distances, m^2, with the robot's points from the general kinematics.
double cost(const EmbodimentMapping& mapping, const EmbodimentConfig& config, const Points& p_P,
            std::span<const double> r) {
  robot::HandKinematics::Workspace workspace;
  mapping.kinematics().update(r, workspace);
  double sum = 0.0;
  std::size_t point = 0;
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!has(config, f)) continue;
    for (std::size_t i = 0; i < 2; ++i)
      sum += (p_P[f][i] - mapping.kinematics().point(point++, workspace)).squaredNorm();
  }
  return sum;
}

class RandomHand {
 public:
  RandomHand(const EmbodimentMapping& mapping, unsigned seed) : mapping_(mapping), engine_(seed) {
    testing::Test::RecordProperty("seed", static_cast<int>(seed));
  }
  std::vector<double> angles() {
    std::vector<double> r;
    for (std::size_t m = 0; m < mapping_.motor_count(); ++m) {
      r.push_back(std::uniform_real_distribution<double>(mapping_.lower_rad(m), mapping_.upper_rad(m))(engine_));
    }
    return r;
  }
  /// Robot points at random angles, displaced by up to `noise_m` each.
  Points points(double noise_m) {
    Points p_P = mapping_.finger_points(angles());
    std::uniform_real_distribution<double> noise(-noise_m, noise_m);
    for (auto& finger : p_P) {
      for (auto& point : finger) {
        if (!point.allFinite()) point.setZero();  // a finger that the hand lacks: the human has it all the same
        for (double& x : point) x += noise(engine_);
      }
    }
    return p_P;
  }

 private:
  const EmbodimentMapping& mapping_;
  std::mt19937 engine_;
};

/// A gripper: one motor turns thumb and index towards each other, `ratio` times as fast, over `range` radians each way.
robot::RobotModel gripper_model(double ratio, double range) {
  const std::string limit = "<axis xyz='0 0 1'/><limit lower='" + std::to_string(-range) + "' upper='" +
                            std::to_string(range) + "' effort='1' velocity='1'/>";
  auto model = robot::load_urdf(
      "<robot name='gripper'><link name='base'/><link name='drive'/><link name='left'/><link name='right'/>"
      "<joint name='motor' type='revolute'><parent link='base'/><child link='drive'/>" +
      limit +
      "</joint>"
      "<joint name='l' type='continuous'><parent link='base'/><child link='left'/><origin xyz='0.03 0 0' "
      "rpy='0.1 0.2 0.3'/><axis xyz='0 1 1'/><mimic joint='motor' multiplier='" +
      std::to_string(ratio) +
      "'/></joint>"
      "<joint name='r' type='continuous'><parent link='base'/><child link='right'/><origin xyz='-0.03 0 0'/>"
      "<axis xyz='0 0 1'/><mimic joint='motor' multiplier='" +
      std::to_string(-ratio) + "' offset='0.3'/></joint></robot>");
  EXPECT_TRUE(model.ok()) << model.error().detail.c_str();
  return std::move(*model);
}

EmbodimentConfig gripper_config(double range) {
  EmbodimentConfig config;
  config.root_link = "base";
  config.motors = {"motor"};
  config.motor_lower_rad = {-range};
  config.motor_upper_rad = {range};
  config.X_PM << 0.1, 0.2, 0.3, 0.01, 0.02, 0.03;
  config.fingers[0] = {"left", {0.0, 0.1, 0.0}, {0.01, 0.05, 0.0}, {}, {}};
  config.fingers[1] = {"right", {0.0, 0.1, 0.0}, {-0.01, 0.05, 0.01}, {}, {}};
  return config;
}

void expect_never_worse_than_a_grid(const EmbodimentConfig& config, const robot::RobotModel& model, double noise_m,
                                    unsigned seed) {
  const EmbodimentMapping fresh = make(config, model);
  RandomHand random_hand(fresh, seed);
  FingerTarget target;
  for (int i = 0; i < 50; ++i) {
    const Points p_P = random_hand.points(noise_m);
    EmbodimentMapping mapping = fresh;
    mapping.step(state_of(mapping, p_P), target);
    ASSERT_TRUE(target.valid);
    std::vector<double> r(target.q_rad.begin(), target.q_rad.begin() + static_cast<long>(target.joint_count));
    const double best = cost(mapping, config, p_P, r);
    for (std::size_t m = 0; m < r.size(); ++m) {
      ASSERT_GE(r[m], mapping.lower_rad(m));
      ASSERT_LE(r[m], mapping.upper_rad(m));
      std::vector<double> other = r;  // the motors are independent: one after the other is enough
      for (int k = 0; k <= 100; ++k) {
        other[m] = mapping.lower_rad(m) + k / 100.0 * (mapping.upper_rad(m) - mapping.lower_rad(m));
        ASSERT_LE(best, cost(mapping, config, p_P, other) + 1e-12) << "hand " << i << ", motor " << m;
      }
    }
  }
}

TEST(EmbodimentMapping, RecoversTheAnglesFromTheRobotsOwnPoints) {
  for (const ThumbMode mode : {ThumbMode::kOpposed, ThumbMode::kLateral}) {
    EmbodimentConfig config = test::mia_config();
    config.thumb_mode = mode;
    config.finger_zero_offset_rad = mode == ThumbMode::kLateral ? 0.25 : 0.0;
    EmbodimentMapping mapping = make(config);
    RandomHand random_hand(mapping, /*seed=*/2);
    FingerTarget target;
    for (int i = 0; i < 1'000; ++i) {
      const std::vector<double> r = random_hand.angles();
      mapping.step(state_of(mapping, mapping.finger_points(r)), target);
      ASSERT_TRUE(target.valid);
      ASSERT_EQ(target.joint_count, 3U);
      for (std::size_t m = 0; m < 3; ++m) ASSERT_NEAR(target.q_rad[m], r[m], 1e-9);
      for (const double residual_m : target.residual_m) ASSERT_LE(residual_m, 1e-9);
    }
  }
}

TEST(EmbodimentMapping, IsNeverWorseThanADenseGridAndStaysWithinTheLimits) {
  expect_never_worse_than_a_grid(test::mia_config(), test::mia_model(), 0.03, /*seed=*/3);
  expect_never_worse_than_a_grid(test::mia_config(), test::mia_model(), 0.3, /*seed=*/4);  // far from any finger
}

TEST(EmbodimentMapping, IsNeverWorseThanADenseGridForCounterRotatingAndManyTurnMotors) {
  expect_never_worse_than_a_grid(gripper_config(0.8), gripper_model(1.0, 1.0), 0.05, /*seed=*/5);
  expect_never_worse_than_a_grid(gripper_config(6.0), gripper_model(0.5, 7.0), 0.05, /*seed=*/6);
  expect_never_worse_than_a_grid(gripper_config(6.0), gripper_model(-2.5, 6.0), 0.05, /*seed=*/7);
}

TEST(EmbodimentMapping, SolvesMiddleRingAndLittleTogetherAndNeverWorseThanTheMeanOfThreeSolutions) {
  const EmbodimentConfig config = test::mia_config();
  EmbodimentMapping mapping = make(config);
  std::vector<EmbodimentMapping> single;
  for (std::size_t finger = 2; finger < kFingers; ++finger) {
    EmbodimentConfig one = config;
    for (std::size_t f = 0; f < kFingers; ++f) {
      if (f != finger) one.fingers[f].link.clear();
    }
    single.push_back(make(one));
  }
  RandomHand random_hand(mapping, /*seed=*/8);
  FingerTarget target, alone;
  int clearly_better = 0;
  for (int i = 0; i < 1'000; ++i) {
    const Points p_P = random_hand.points(0.05);
    const HandState state = state_of(mapping, p_P);
    mapping.step(state, target);
    std::vector<double> together(target.q_rad.begin(), target.q_rad.begin() + 3), mean = together;
    mean[2] = 0.0;
    for (EmbodimentMapping& finger : single) {
      finger.step(state, alone);
      mean[2] += alone.q_rad[2] / 3.0;
    }
    const double cost_together = cost(mapping, config, p_P, together), cost_mean = cost(mapping, config, p_P, mean);
    ASSERT_LE(cost_together, cost_mean + 1e-15);
    clearly_better += cost_together < cost_mean - 1e-7 ? 1 : 0;
  }
  EXPECT_GT(clearly_better, 100);
}

// Two minima of about the same cost must not alternate: what the hand did before counts for up to a tenth of the cost.
TEST(EmbodimentMapping, DependsOnEarlierHandsByATenthOfTheCostAtMost) {
  const EmbodimentConfig config = test::mia_config();
  EmbodimentMapping with_history = make(config);
  const EmbodimentMapping without_history = with_history;
  RandomHand random_hand(with_history, /*seed=*/9);
  FingerTarget target, fresh_target;
  int equal = 0;
  for (int i = 0; i < 100; ++i) {
    const Points p_P = random_hand.points(0.05);
    const HandState state = state_of(with_history, p_P);
    with_history.step(state, target);
    EmbodimentMapping fresh = without_history;
    fresh.step(state, fresh_target);
    ASSERT_LE(0.9 * cost(with_history, config, p_P, target.q_rad),
              cost(with_history, config, p_P, fresh_target.q_rad) + 1e-12);
    equal += std::abs(target.q_rad[1] - fresh_target.q_rad[1]) < 1e-6 ? 1 : 0;
  }
  EXPECT_GT(equal, 80);
}

TEST(EmbodimentMapping, ReportsTheRootMeanSquareDistanceOfEachFinger) {
  EmbodimentMapping mapping = make(test::mia_config());
  Points p_P = mapping.finger_points(std::array<double, 3>{0.5, 0.5, 0.5});
  const Eigen::Vector3d across(1.0, 0.0, 0.0);
  p_P[2][0] += 0.004 * across;  // the middle finger turns about the palm's x axis: no angle can help
  p_P[2][1] += 0.004 * across;
  FingerTarget target;
  mapping.step(state_of(mapping, p_P), target);
  EXPECT_NEAR(target.q_rad[2], 0.5, 1e-5);
  EXPECT_NEAR(target.residual_m[2], 0.004, 1e-7);
  EXPECT_NEAR(target.residual_m[3], 0.0, 1e-6);
}

TEST(EmbodimentMapping, PassesTimesOnAndRepeatsTheLastAnglesWhenTheHandIsInvalid) {
  EmbodimentMapping mapping = make(test::mia_config());
  HandState state = state_of(mapping, mapping.finger_points(std::array<double, 3>{0.2, 0.4, 0.6}));
  state.frame_number = 7;
  state.t_capture = TimePoint(Duration(11));
  state.t_arrival = TimePoint(Duration(13));
  FingerTarget target;
  mapping.step(state, target);
  ASSERT_TRUE(target.valid);
  EXPECT_EQ(target.frame_number, 7U);
  EXPECT_EQ(target.t_capture, state.t_capture);
  EXPECT_EQ(target.t_arrival, state.t_arrival);
  const std::array<double, kMaxHandJoints> last = target.q_rad;

  HandState invalid = state_of(mapping, mapping.finger_points(std::array<double, 3>{1.0, 1.0, 1.0}));
  invalid.valid = false;
  mapping.step(invalid, target);
  EXPECT_FALSE(target.valid);
  EXPECT_EQ(target.q_rad, last);

  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300}) {
    invalid.valid = true;
    invalid.p_M[4][1].x() = bad;
    mapping.step(invalid, target);
    for (std::size_t m = 0; m < target.joint_count; ++m) {
      EXPECT_TRUE(target.q_rad[m] >= mapping.lower_rad(m) && target.q_rad[m] <= mapping.upper_rad(m)) << bad;
    }
    if (!std::isfinite(bad)) {
      EXPECT_FALSE(target.valid);
      EXPECT_EQ(target.q_rad, last);
    }
  }
  mapping.step(state, target);
  EXPECT_TRUE(target.valid);
}

TEST(EmbodimentMapping, AJointIsAsSureAsTheLeastSureFingerThatItFollows) {
  EmbodimentMapping mapping = make(test::mia_config());
  HandState state = state_of(mapping, mapping.finger_points(std::array<double, 3>{0.2, 0.4, 0.6}));
  state.confidence = {0.9, 0.8, 0.7, 0.3, 0.6};
  FingerTarget target;
  mapping.step(state, target);
  EXPECT_EQ(target.joint_confidence[0], 0.9) << "thumb";
  EXPECT_EQ(target.joint_confidence[1], 0.8) << "index";
  EXPECT_EQ(target.joint_confidence[2], 0.3) << "middle, ring and little finger share a motor";
  state.confidence = {0.1, 0.2, 0.3, 0.4, 0.5};
  mapping.step(state, target);
  EXPECT_EQ(target.joint_confidence[2], 0.3) << "nothing is kept from the last step";
}

TEST(EmbodimentMapping, FollowsOnlyFingersThatHaveAnEstimate) {
  EmbodimentMapping mapping = make(test::mia_config());
  FingerTarget whole, partial;
  HandState state = state_of(mapping, mapping.finger_points(std::array<double, 3>{0.2, 0.4, 0.6}));
  mapping.step(state, whole);
  EXPECT_NEAR(whole.q_rad[2], 0.6, 1e-9);
  // A glove without markers on ring and little finger: the flat fingers of the model must not hold the motor back.
  for (const std::size_t unworn : {3, 4}) {
    state.quality[unworn] = FingerQuality::kNone;
    state.confidence[unworn] = 0.0;
    for (auto& p_M : state.p_M[unworn]) p_M.setZero();
  }
  mapping.step(state, partial);
  EXPECT_NEAR(partial.q_rad[2], 0.6, 1e-9);
  EXPECT_EQ(partial.joint_confidence[2], 1.0) << "the middle finger is sure";
  EXPECT_EQ(partial.residual_m[4], 0.0) << "nothing to compare";
  state.quality[2] = FingerQuality::kNone;
  state.p_M[2][0].setZero();
  mapping.step(state, partial);
  EXPECT_TRUE(partial.valid);
  EXPECT_NEAR(partial.q_rad[2], 0.6, 1e-9) << "kept";
  EXPECT_EQ(partial.joint_confidence[2], 0.0) << "and not to be followed";
  EXPECT_EQ(partial.joint_confidence[1], 1.0);
}

TEST(EmbodimentMapping, CallsAConfidenceThatIsNoNumberUnsure) {
  EmbodimentMapping mapping = make(test::mia_config());
  HandState state = state_of(mapping, mapping.finger_points(std::array<double, 3>{0.2, 0.4, 0.6}));
  for (const std::size_t finger : {2, 3, 4}) {
    state.confidence = {1.0, 1.0, 1.0, 1.0, 1.0};
    state.confidence[finger] = std::numeric_limits<double>::quiet_NaN();
    FingerTarget target;
    mapping.step(state, target);
    EXPECT_EQ(target.joint_confidence[2], 0.0) << kFingerNames[finger];
  }
}

TEST(EmbodimentMapping, StartsAtTheAngleNearestToZeroBeforeTheFirstValidHand) {
  EmbodimentConfig config = test::mia_config();
  config.motor_lower_rad[1] = 0.3;
  EmbodimentMapping mapping = make(config);
  FingerTarget target;
  mapping.step(HandState{}, target);
  EXPECT_FALSE(target.valid);
  EXPECT_EQ(target.joint_count, 3U);
  EXPECT_EQ(target.q_rad[0], 0.0);
  EXPECT_EQ(target.q_rad[1], 0.3);
}

TEST(EmbodimentMapping, GivesAllUrdfAnglesWithMimicJointsAndTheThumbsOpposition) {
  EmbodimentConfig config = test::mia_config();
  config.thumb_mode = ThumbMode::kLateral;
  const EmbodimentMapping mapping = make(config);
  const HandJointAngles angles = mapping.urdf_joint_angles(std::array<double, 3>{0.1, -0.9, 0.3});
  ASSERT_EQ(angles.count, 6U);
  ASSERT_EQ(mapping.urdf_joint_names().size(), 6U);
  for (std::size_t i = 0; i < angles.count; ++i) {
    const std::string& name = mapping.urdf_joint_names()[i];
    const double expected = name == "j_thumb_fle"   ? 0.1
                            : name == "j_index_fle" ? 0.9
                            : name == "j_thumb_opp" ? -0.628319
                                                    : 0.3;
    EXPECT_EQ(angles.q_rad[i], expected) << name;
  }
  EXPECT_EQ(mapping.motor_names(), (std::vector<std::string>{"j_thumb_fle", "j_index_fle", "j_mrl_fle"}));
}

TEST(EmbodimentMapping, KeepsTheIndexFromItsNegativeHalfAndIntersectsTheUrdfsLimits) {
  EmbodimentConfig config = test::mia_config();
  EXPECT_EQ(make(config).lower_rad(1), 0.0731);
  config.motor_lower_rad[1] = -9.0;
  config.motor_upper_rad[2] = 9.0;
  EXPECT_EQ(make(config).lower_rad(1), 0.0731);
  config.thumb_mode = ThumbMode::kLateral;
  EXPECT_EQ(make(config).lower_rad(1), -1.4);
  EXPECT_EQ(make(config).upper_rad(1), 0.0);
  EXPECT_EQ(make(config).upper_rad(2), 1.39626);
}

TEST(EmbodimentMapping, ExplainsConfigurationsThatDoNotFit) {
  const robot::RobotModel model = test::mia_model();
  const auto expect_error = [&](const char* mentions, auto change) {
    EmbodimentConfig config = test::mia_config();
    change(config);
    const Result<EmbodimentMapping> mapping = EmbodimentMapping::create(model, config);
    ASSERT_FALSE(mapping.ok()) << mentions;
    EXPECT_NE(mapping.error().detail.view().find(mentions), std::string_view::npos) << mapping.error().detail.c_str();
  };
  expect_error("root_link", [](auto& c) { c.root_link = "rh_forearm"; });
  expect_error("X_PM", [](auto& c) { c.X_PM[2] = NAN; });
  expect_error("motors", [](auto& c) { c.motors.clear(); });
  expect_error("motor_lower_rad", [](auto& c) { c.motor_lower_rad.pop_back(); });
  expect_error("motor_upper_rad", [](auto& c) { c.motor_upper_rad[0] = INFINITY; });
  expect_error("'j_index_fle' has an empty range", [](auto& c) { c.motor_lower_rad[1] = 1.5; });
  expect_error("couplings", [](auto& c) { c.couplings[0].joint_rad.pop_back(); });
  expect_error("'j_thumb_opp' leaves", [](auto& c) { c.couplings[1].joint_rad[1] = 0.5; });
  expect_error("must increase", [](auto& c) { std::swap(c.couplings[1].motor_rad[0], c.couplings[1].motor_rad[1]); });
  expect_error("'crank'", [](auto& c) { c.couplings[1].motor = "crank"; });
  expect_error("thumb_motor", [](auto& c) { c.thumb_motor = "crank"; });
  expect_error("'j_toe'", [](auto& c) { c.motors[0] = "j_toe"; });
  expect_error("'toe'", [](auto& c) { c.fingers[3].link = "toe"; });
  expect_error("'j_toe'", [](auto& c) { c.zero_offset_joints[0] = "j_toe"; });
  expect_error("finger_zero_offset_rad", [](auto& c) { c.finger_zero_offset_rad = NAN; });
}

TEST(EmbodimentMapping, NeverAllocatesInAStep) {
  EmbodimentMapping mapping = make(test::mia_config());
  const HandState state = state_of(mapping, mapping.finger_points(std::array<double, 3>{0.2, 0.4, 0.6}));
  FingerTarget target;
  const std::uint64_t before = test::heap_allocations();
  mapping.step(state, target);
  const HandJointAngles angles = mapping.urdf_joint_angles(target.q_rad);
  EXPECT_EQ(test::heap_allocations(), before);
  EXPECT_EQ(angles.count, 6U);
}

}  // namespace
}  // namespace embody
