#include "drivers/sim/ur/ur_robot.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "drivers/sim/ur/flange_pose.hpp"

namespace embody::sim {
namespace {

constexpr Duration kCycle = std::chrono::milliseconds(2);
constexpr double kCycle_s = 0.002;

/// The robot with a sender that never stops.
class Robot {
 public:
  explicit Robot(const UrRobotConfig& config = {}) : robot(config) {}
  void run(int cycles, std::int32_t mode, const Vector6& q, const Vector6& qd = Vector6::Zero()) {
    for (int i = 0; i < cycles; ++i) robot.step({++sequence, mode, q, qd}, kCycle);
  }
  void arm() {
    run(1, 0, Vector6::Zero());
    run(1, 1, robot.q_rad());
    ASSERT_EQ(robot.registers().state, ProgramState::kTracking);
  }
  UrRobot robot;
  std::int32_t sequence{0};
};

UrRobotConfig at_zero() {
  UrRobotConfig config;
  config.q_start_rad.setZero();
  return config;
}

TEST(ServoPlant, LagsARampByTheConfiguredTime) {
  ServoPlant plant({}, Vector6::Zero());
  double set = 0.0;
  for (int i = 0; i < 1000; ++i) plant.follow(Vector6::Constant(set = 0.5 * i * kCycle_s), kCycle);
  EXPECT_NEAR((set - plant.q_rad()[0]) / 0.5, 0.050, 0.003);
  EXPECT_NEAR(plant.qd_rad_s()[0], 0.5, 1e-3);
}

TEST(ServoPlant, ReachesAStepWithoutOvershoot) {
  ServoPlant plant({}, Vector6::Zero());
  for (int i = 0; i < 500; ++i) {
    plant.follow(Vector6::Constant(0.01), kCycle);
    ASSERT_LE(plant.q_rad().maxCoeff(), 0.01 + 1e-12);
  }
  EXPECT_NEAR(plant.q_rad()[3], 0.01, 1e-6);
}

TEST(ServoPlant, NeverExceedsTheSpeedOfItsMotors) {
  const ServoPlantConfig config;
  ServoPlant plant(config, Vector6::Zero());
  Vector6 before = plant.q_rad();
  for (int i = 0; i < 500; ++i) {
    plant.follow(Vector6::Constant(i % 100 < 50 ? 3.0 : -3.0), kCycle);
    for (int k = 0; k < 6; ++k) {
      ASSERT_LE(std::abs(plant.q_rad()[k] - before[k]), config.max_speed_rad_s[k] * kCycle_s + 1e-12);
    }
    before = plant.q_rad();
  }
}

TEST(UrRobot, FollowsASineWithinItsLagOnceArmed) {
  Robot sim(at_zero());
  sim.arm();
  double worst = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const double t = i * kCycle_s;
    const double w = std::numbers::pi;
    sim.run(1, 1, Vector6::Constant(0.2 * std::sin(w * t)), Vector6::Constant(0.2 * w * std::cos(w * t)));
    if (t > 1.0) worst = std::max(worst, std::abs(sim.robot.q_rad()[2] - 0.2 * std::sin(w * (t - 0.05))));
  }
  EXPECT_LT(worst, 0.01);
}

TEST(UrRobot, AStepOfOneRadianKeepsTheProgramsLimitsInTheActualJoints) {
  Robot sim(at_zero());
  sim.arm();
  const RegisterProgramConfig limits;
  Vector6 before = sim.robot.qd_rad_s();
  for (int i = 0; i < 1500; ++i) {
    sim.run(1, 1, Vector6::Constant(1.0));
    for (int k = 0; k < 6; ++k) {
      ASSERT_LE(std::abs(sim.robot.qd_rad_s()[k]), limits.max_velocity_rad_s[k] + 1e-9);
      ASSERT_LE(std::abs(sim.robot.qd_rad_s()[k] - before[k]), limits.max_acceleration_rad_s2[k] * kCycle_s + 1e-9);
    }
    before = sim.robot.qd_rad_s();
  }
  EXPECT_NEAR(sim.robot.q_rad()[0], 1.0, 1e-3);
}

/// What must hold in every kind of stop: at rest within 0.3 s, and targets have no effect.
void expect_stop(const std::function<void(UrRobot&)>& trigger, std::int32_t safety_status,
                 std::uint32_t runtime_state) {
  Robot sim(at_zero());
  sim.arm();
  sim.run(200, 1, Vector6::Constant(2.0));
  ASSERT_GT(sim.robot.qd_rad_s()[0], 0.9);
  trigger(sim.robot);
  sim.run(151, 1, Vector6::Constant(2.0));
  EXPECT_LT(sim.robot.qd_rad_s().cwiseAbs().maxCoeff(), 1e-9);
  const Vector6 rest = sim.robot.q_rad();
  sim.run(500, 0, rest);
  sim.run(500, 1, rest + Vector6::Constant(0.05));
  EXPECT_LT((sim.robot.q_rad() - rest).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_EQ(sim.robot.safety().safety_status, safety_status);
  EXPECT_EQ(sim.robot.safety().runtime_state, runtime_state);
}

TEST(UrRobot, AProtectiveStopBringsItToRestAndIgnoresTargets) {
  expect_stop([](UrRobot& robot) { robot.protective_stop(); }, 3, 4);
}

TEST(UrRobot, AnEmergencyStopAlsoDuringAProtectiveStopBringsItToRest) {
  expect_stop([](UrRobot& robot) { robot.emergency_stop(); }, 7, 1);
  expect_stop(
      [](UrRobot& robot) {
        robot.protective_stop();
        robot.emergency_stop();
        robot.protective_stop();  // must not lower it again
      },
      7, 1);
}

TEST(UrRobot, AStoppedProgramBringsItToRest) {
  expect_stop([](UrRobot& robot) { robot.set_program_running(false); }, 1, 1);
}

TEST(UrRobot, AfterAStopWasClearedNothingMovesBeforeItIsArmedAgain) {
  Robot sim(at_zero());
  sim.arm();
  sim.run(200, 1, Vector6::Constant(2.0));
  sim.robot.protective_stop();
  sim.run(200, 1, Vector6::Constant(2.0));
  sim.robot.clear_stop();
  const Vector6 rest = sim.robot.q_rad();
  sim.run(200, 1, rest + Vector6::Constant(0.05));
  EXPECT_EQ(sim.robot.q_rad(), rest);
  EXPECT_EQ(sim.robot.safety().runtime_state, 2U);
  sim.arm();
  sim.run(200, 1, rest + Vector6::Constant(0.05));
  EXPECT_GT(sim.robot.q_rad()[0], rest[0] + 0.04);
}

TEST(UrRobot, AProgramCannotBeStartedDuringAStop) {
  Robot sim;
  sim.robot.protective_stop();
  sim.robot.set_program_running(true);
  EXPECT_EQ(sim.robot.safety().runtime_state, 4U);
}

TEST(UrRobot, TooFastAJointTriggersAProtectiveStop) {
  UrRobotConfig config = at_zero();
  config.program.max_velocity_rad_s.setConstant(4.0);  // a program that does not know the robot's limits
  config.program.max_acceleration_rad_s2.setConstant(40.0);
  Robot sim(config);
  sim.arm();
  sim.run(500, 1, Vector6::Constant(3.0));
  EXPECT_EQ(sim.robot.safety().safety_status, 3);
  EXPECT_NE(sim.robot.safety().safety_status_bits & 0b100U, 0U);
}

TEST(UrRobot, AJointOutsideItsRangeTriggersAProtectiveStop) {
  UrRobotConfig config = at_zero();
  config.limits.max_angle_rad = 0.5;
  Robot sim(config);
  sim.arm();
  sim.run(1000, 1, Vector6::Constant(1.0));
  EXPECT_EQ(sim.robot.safety().safety_status, 3);
  EXPECT_LT(sim.robot.q_rad().maxCoeff(), 1.0);
}

TEST(UrRobot, ExitEndsTheProgram) {
  Robot sim;
  sim.arm();
  sim.run(1, 9, Vector6::Zero());
  EXPECT_EQ(sim.robot.safety().runtime_state, 1U);
  EXPECT_EQ(sim.robot.registers().state, ProgramState::kEnded);
}

// Independent values: the vendor's DH parameters evaluated by another program.
TEST(FlangePose, AgreesWithKnownPosesOfTheNominalUr10e) {
  constexpr double kQuarter = std::numbers::pi / 2.0;
  struct Case {
    Vector6 q, pose;
  };
  const std::array<Case, 3> cases{{
      {Vector6::Zero(), Vector6(-1.18425, -0.2907, 0.06085, 1.570796, 0.0, 0.0)},
      {Vector6(0.0, -kQuarter, kQuarter, -kQuarter, -kQuarter, 0.0),
       Vector6(-0.6914, -0.17415, 0.67685, 2.221441, 2.221441, 0.0)},
      {Vector6(0.3, -1.2, 1.8, -2.1, -1.4, 0.7), Vector6(-0.711882, -0.423239, 0.305995, 2.470204, 1.626768, 0.029219)},
  }};
  for (const Case& test : cases) {
    const math::Pose X_BE = ur10e_flange_pose(test.q);
    EXPECT_LT((X_BE.translation() - test.pose.head<3>()).norm(), 2e-6);
    EXPECT_LT((math::log_so3(X_BE.linear()) - test.pose.tail<3>()).norm(), 2e-6);
  }
}

}  // namespace
}  // namespace embody::sim
