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
  explicit Robot(const UrRobotConfig& config = {}, Duration cycle = kCycle) : robot(config), cycle_(cycle) {
    robot.step(last, cycle_);  // its program begins with a stop
  }
  void run(int cycles, std::int32_t mode, const Vector6& q, const Vector6& qd = Vector6::Zero()) {
    for (int i = 0; i < cycles; ++i) {
      robot.step(last = {last.sequence + 1, mode, q, qd, last.packages + 1}, cycle_);
    }
  }
  /// Cycles without any package.
  void starve(int cycles) {
    for (int i = 0; i < cycles; ++i) robot.step(last, cycle_);
  }
  void arm() {
    run(3, 0, Vector6::Zero());
    run(1, 1, robot.q_rad());
    ASSERT_EQ(robot.registers().state, ProgramState::kTracking);
  }
  /// The first text of this kind that has not been taken yet.
  std::optional<RobotText> text(RobotText::Kind kind) {
    while (auto text = robot.next_text()) {
      if (text->kind == kind) return text;
    }
    return std::nullopt;
  }
  UrRobot robot;
  RegisterInputs last;

 private:
  Duration cycle_;
};

UrRobotConfig at_zero() {
  UrRobotConfig config;
  config.q_start_rad.setZero();
  return config;
}

TEST(UrRobot, FollowsASineWithinItsLagOnceArmed) {
  Robot sim(at_zero());
  sim.arm();
  const double lag_s = to_seconds(servo_lag(0.05, 600.0));
  double worst = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const double t = i * kCycle_s;
    const double w = std::numbers::pi;
    sim.run(1, 1, Vector6::Constant(0.2 * std::sin(w * t)), Vector6::Constant(0.2 * w * std::cos(w * t)));
    if (t > 1.0) worst = std::max(worst, std::abs(sim.robot.q_rad()[2] - 0.2 * std::sin(w * (t - lag_s))));
  }
  EXPECT_LT(worst, 0.005);
}

TEST(UrRobot, AStepOfOneRadianKeepsTheProgramsLimitsInTheActualJoints) {
  Robot sim(at_zero());
  sim.arm();
  const rtde::ControlScriptConfig limits;
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
  const auto text = sim.text(RobotText::Kind::kStopCode);
  ASSERT_TRUE(text);
  EXPECT_EQ(text->code, 191);
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
  sim.run(2, 9, Vector6::Zero());
  EXPECT_EQ(sim.robot.safety().runtime_state, 1U);
  EXPECT_EQ(sim.robot.registers().state, ProgramState::kEnded);
}

TEST(UrRobot, ExitWhileMovingBrakesAtTheStopsDeceleration) {
  Robot sim(at_zero());
  sim.arm();
  sim.run(400, 1, Vector6::Constant(2.0));
  const double from = sim.robot.q_rad()[0];
  ASSERT_NEAR(sim.robot.qd_rad_s()[0], 1.0, 1e-3);
  sim.run(300, 9, Vector6::Zero());
  EXPECT_EQ(sim.robot.safety().runtime_state, 1U);
  EXPECT_EQ(sim.robot.qd_rad_s(), Vector6(Vector6::Zero()));
  EXPECT_NEAR(sim.robot.q_rad()[0] - from, 0.125, 0.005);
}

TEST(UrRobot, APulledCableWhileMovingEndsTheProgramAndTheMotion) {
  Robot sim(at_zero());
  sim.arm();
  sim.run(400, 1, Vector6::Constant(3.0));
  ASSERT_NEAR(sim.robot.qd_rad_s()[0], 1.0, 1e-3);
  const double from = sim.robot.q_rad()[0];
  sim.starve(30);
  EXPECT_EQ(sim.robot.registers().state, ProgramState::kStale) << "noticed by the sequence first";
  sim.starve(30);
  EXPECT_EQ(sim.robot.safety().runtime_state, 1U) << "then by the watchdog";
  sim.starve(200);
  EXPECT_EQ(sim.robot.qd_rad_s(), Vector6(Vector6::Zero()));
  EXPECT_LT(sim.robot.q_rad()[0] - from, 0.055 + 0.05 + 0.15);
  const Vector6 rest = sim.robot.q_rad();
  sim.run(100, 1, rest + Vector6::Constant(0.05));
  EXPECT_EQ(sim.robot.q_rad(), rest) << "commands that come back later find no program";
}

TEST(UrRobot, TheSpeedSliderStretchesTimeAndNothingElse) {
  const auto time_to_move = [](double slider) {
    Robot sim(at_zero());
    sim.robot.set_speed_fraction(slider);
    sim.run(10, 0, Vector6::Zero());
    sim.run(10, 1, Vector6::Zero());
    int cycles = 0;
    double fastest = 0.0;
    while (sim.robot.q_rad()[0] < 0.9 && cycles < 20'000) {
      sim.run(1, 1, Vector6::Constant(1.0));
      fastest = std::max(fastest, sim.robot.qd_rad_s()[0]);
      ++cycles;
    }
    EXPECT_LE(fastest, slider + 0.01);
    EXPECT_EQ(sim.robot.safety().safety_status, 1);
    return cycles * kCycle_s;
  };
  const double full = time_to_move(1.0);
  EXPECT_NEAR(time_to_move(0.5), 2.0 * full, 0.1);
  EXPECT_NEAR(time_to_move(0.25), 4.0 * full, 0.2);
}

TEST(UrRobot, ReachesTheTargetAt125HzAsWell) {
  Robot sim(at_zero(), std::chrono::milliseconds(8));
  sim.arm();
  sim.run(500, 1, Vector6::Constant(1.0));
  EXPECT_LT((sim.robot.q_rad() - Vector6::Constant(1.0)).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_EQ(sim.robot.safety().safety_status, 1);
}

TEST(UrRobot, ASetPointThatJumpsIsAProtectiveStopC204A1) {
  UrRobotConfig config = at_zero();
  config.program_text = "def jump():\n  servoj([0,0,0,0,0,0], t=0.002)\n  servoj([0,0.1,0,0,0,0], t=0.002)\nend\n";
  Robot sim(config);
  sim.run(5, 0, Vector6::Zero());
  EXPECT_EQ(sim.robot.safety().safety_status, 3);
  const auto text = sim.text(RobotText::Kind::kStopCode);
  ASSERT_TRUE(text);
  EXPECT_EQ(text->code, 204);
  EXPECT_EQ(text->argument, 1);
  EXPECT_EQ(sim.robot.q_rad(), Vector6(Vector6::Zero()));
}

TEST(UrRobot, LongServoCallsGoEvenlyToTheirTarget) {
  UrRobotConfig config = at_zero();
  config.program_text =
      "def far():\n  servoj([0.5,0,0,0,0,0], t=1)\n  while True:\n    servoj([0.5,0,0,0,0,0])\n  end\nend\n";
  Robot sim(config);
  for (int i = 0; i < 499; ++i) {
    sim.run(1, 0, Vector6::Zero());
    ASSERT_NEAR(sim.robot.qd_target_rad_s()[0], 0.5, 1e-9);
  }
  EXPECT_NEAR(sim.robot.q_target_rad()[0], 0.5, 1e-9);
}

TEST(UrRobot, AMovingArmWithoutServoCallsDecelerates) {
  UrRobotConfig config = at_zero();
  config.program_text =
      "def gap():\n  q = [0.0,0,0,0,0,0]\n  k = 0\n  while k < 200:\n    q[0] = q[0] + 0.001\n    servoj(q, t=0.002)\n"
      "    k = k + 1\n  end\n  sleep(10)\nend\n";
  Robot sim(config);
  sim.run(199, 0, Vector6::Zero());
  ASSERT_NEAR(sim.robot.qd_rad_s()[0], 0.5, 0.01);
  sim.run(152, 0, Vector6::Zero());
  EXPECT_EQ(sim.robot.qd_rad_s(), Vector6(Vector6::Zero()));
  EXPECT_EQ(sim.robot.safety().runtime_state, 2U) << "the program itself goes on";
}

TEST(UrRobot, AScriptThatDoesNotCompileRunsNothing) {
  Robot sim;
  sim.arm();
  const Status loaded = sim.robot.load_program("def bad():\n  speedj([0,0,0,0,0,0], 1, 1)\nend\n");
  ASSERT_FALSE(loaded.ok());
  EXPECT_EQ(loaded.error().code, Errc::kMalformed);
  EXPECT_STREQ(loaded.error().detail.c_str(), "line 2: compile_error_name_not_found:speedj:");
  sim.run(1, 0, Vector6::Zero());
  EXPECT_EQ(sim.robot.safety().runtime_state, 1U);
  EXPECT_FALSE(sim.robot.has_program());
  const auto text = sim.text(RobotText::Kind::kException);
  ASSERT_TRUE(text);
  EXPECT_EQ(text->line, 2);
}

TEST(UrRobot, ARuntimeErrorEndsTheProgramWithItsLine) {
  Robot sim;
  ASSERT_TRUE(sim.robot.load_program("def bad():\n  sync()\n  x = [1]\n  y = x[1]\nend\n").ok());
  sim.run(5, 0, Vector6::Zero());
  EXPECT_EQ(sim.robot.safety().runtime_state, 1U);
  EXPECT_EQ(sim.robot.safety().safety_status, 1);
  const auto text = sim.text(RobotText::Kind::kException);
  ASSERT_TRUE(text);
  EXPECT_EQ(text->line, 4);
  EXPECT_STREQ(text->text.c_str(), "Index out of range: 1 of 1");
}

TEST(UrRobot, AnEndlessLoopIsAProtectiveStopC218) {
  Robot sim;
  ASSERT_TRUE(sim.robot.load_program("def busy():\n  while True:\n    x = 1\n  end\nend\n").ok());
  sim.run(2, 0, Vector6::Zero());
  EXPECT_EQ(sim.robot.safety().safety_status, 3);
  EXPECT_EQ(sim.text(RobotText::Kind::kStopCode)->code, 218);
}

TEST(UrRobot, ANewProgramReplacesTheOldOneWithoutMotion) {
  Robot sim(at_zero());
  sim.arm();
  sim.run(300, 1, Vector6::Constant(2.0));
  const auto text = rtde::control_script({});
  ASSERT_TRUE(sim.robot.load_program(*text).ok());
  const double from = sim.robot.q_rad()[0];
  sim.run(500, 1, Vector6::Constant(2.0));
  EXPECT_NE(sim.robot.registers().state, ProgramState::kTracking) << "it has not seen mode 0";
  EXPECT_NEAR(sim.robot.q_rad()[0] - from, 0.125, 0.01) << "stopj at its beginning";
  EXPECT_EQ(sim.robot.qd_rad_s(), Vector6(Vector6::Zero()));
}

TEST(UrRobot, AProgramLoadedDuringAStopWaits) {
  Robot sim;
  sim.robot.emergency_stop();
  ASSERT_TRUE(sim.robot.load_program("def p():\n  textmsg(\"hello\")\nend\n").ok());
  sim.run(5, 0, Vector6::Zero());
  EXPECT_EQ(sim.robot.safety().runtime_state, 1U);
  EXPECT_FALSE(sim.text(RobotText::Kind::kText));
  EXPECT_EQ(sim.robot.program_name(), "p");
}

TEST(UrRobot, ASecondaryProgramRunsBesideTheFirst) {
  Robot sim;
  sim.arm();
  ASSERT_TRUE(sim.robot.load_program("sec note():\n  textmsg(\"hello \", 7)\nend\n").ok());
  sim.run(1, 1, sim.robot.q_rad());
  EXPECT_EQ(sim.robot.registers().state, ProgramState::kTracking);
  EXPECT_STREQ(sim.text(RobotText::Kind::kText)->text.c_str(), "hello 7");
  ASSERT_TRUE(sim.robot.load_program("sec move():\n  stopj(1)\nend\n").ok());
  sim.run(1, 1, sim.robot.q_rad());
  EXPECT_EQ(sim.text(RobotText::Kind::kException)->text.view().substr(0, 4), "C271");
  EXPECT_EQ(sim.robot.registers().state, ProgramState::kTracking);
}

TEST(UrRobot, WithoutAProgramNothingRuns) {
  UrRobotConfig config;
  config.program_text = "";
  Robot sim(config);
  sim.run(10, 0, Vector6::Zero());
  EXPECT_EQ(sim.robot.safety().runtime_state, 1U);
  EXPECT_EQ(sim.robot.registers().version, 0);
  sim.robot.set_program_running(true);
  sim.robot.clear_stop();
  sim.run(10, 0, Vector6::Zero());
  EXPECT_EQ(sim.robot.safety().runtime_state, 1U);
}

TEST(UrRobot, LimitsThatTheScriptRefusesAreReported) {
  UrRobotConfig config;
  config.program.gain = 5.0;
  UrRobot robot(config);
  EXPECT_FALSE(robot.program_status().ok());
  EXPECT_FALSE(robot.has_program());
}

// After a safeguard stop the controller lets the program go on where it was; the arm has come to rest somewhere else.
TEST(UrRobot, AfterASafeguardStopTheArmStaysWhereItStopped) {
  for (const double distance : {3.0, 0.12, 0.03}) {
    for (const std::int32_t mode : {0, 1}) {
      Robot sim(at_zero());
      sim.arm();
      sim.run(100, 1, Vector6::Constant(distance));
      sim.robot.machine().safeguard_stop(true);
      sim.run(500, mode, Vector6::Constant(distance));
      const Vector6 rest = sim.robot.q_rad();
      sim.robot.machine().safeguard_stop(false);
      sim.run(500, mode, Vector6::Constant(distance));
      const double moved = (sim.robot.q_rad() - rest).cwiseAbs().maxCoeff();
      EXPECT_LT(moved, 0.02) << "distance " << distance << " mode " << mode;
      if (distance > 1.0) {
        EXPECT_EQ(sim.robot.safety().safety_status, 1) << "without a jump of the set-point, mode " << mode;
      }
    }
  }
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
