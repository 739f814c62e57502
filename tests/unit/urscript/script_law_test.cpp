// The rules of the control script, each as a law about the text that goes to the robot.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/heap_counter.hpp"
#include "tests/unit/urscript/adversary.hpp"
#include "tests/unit/urscript/script_runner.hpp"

namespace embody::sim {
namespace {

using urscript::Outcome;

/// Both control rates: e-Series and CB3.
class ScriptLaw : public ::testing::TestWithParam<int> {
 protected:
  [[nodiscard]] Duration cycle() const { return std::chrono::milliseconds(GetParam()); }
  [[nodiscard]] ScriptRunner runner(const Vector6& q = kStart, const rtde::ControlScriptConfig& config = {}) const {
    return ScriptRunner(q, config, cycle());
  }
  [[nodiscard]] int cycles(double seconds) const {
    return static_cast<int>(std::lround(seconds / to_seconds(cycle())));
  }
};
INSTANTIATE_TEST_SUITE_P(ESeriesAndCb3, ScriptLaw, ::testing::Values(2, 8),
                         [](const auto& test) { return std::to_string(1000 / test.param) + "Hz"; });

TEST_P(ScriptLaw, ZeroRegistersNeverMove) {
  ScriptRunner script = runner();
  for (int i = 0; i < cycles(1.0); ++i) script.starve();
  for (int i = 0; i < cycles(1.0); ++i) script.send(0, Vector6::Zero());
  for (int i = 0; i < cycles(1.0); ++i) script.send(1, Vector6::Zero());  // armed, but far away
  EXPECT_EQ(script.q(), kStart);
  EXPECT_EQ(script.out().fault, ProgramFault::kFarTarget);
}

TEST_P(ScriptLaw, ModeOneWithoutModeZeroBeforeNeverMoves) {
  ScriptRunner script = runner();
  for (int i = 0; i < cycles(1.0); ++i) script.send(1, kStart + Vector6::Constant(0.05));
  EXPECT_EQ(script.q(), kStart);
  EXPECT_NE(script.out().state, ProgramState::kTracking);
}

TEST_P(ScriptLaw, ValuesThatAreNotFiniteNeverMove) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double bad : {std::nan(""), kInfinity, -kInfinity, 1e300, 6.21, -6.21}) {
    for (int joint = 0; joint < 6; ++joint) {
      ScriptRunner script = runner();
      Vector6 q = kStart;
      q[joint] = bad;
      script.send(0, Vector6::Zero());
      for (int i = 0; i < 50; ++i) script.send(1, q);
      EXPECT_EQ(script.q(), kStart);
      EXPECT_EQ(script.out().fault, ProgramFault::kOutOfRange);
      script.arm();
      for (int i = 0; i < 50; ++i) script.send(1, q, Vector6::Constant(bad));
      EXPECT_EQ(script.q(), kStart) << "keeps the last good target";
      EXPECT_EQ(script.out().state, ProgramState::kTracking);
    }
  }
}

TEST_P(ScriptLaw, AFarFirstTargetNeedsModeZeroAgain) {
  ScriptRunner script = runner();
  script.send(0, kStart);
  script.send(1, kStart + Vector6::Constant(0.101));
  EXPECT_EQ(script.out().fault, ProgramFault::kFarTarget);
  for (int i = 0; i < 10; ++i) script.send(1, kStart);
  EXPECT_EQ(script.out().state, ProgramState::kHold);
  script.arm();
  EXPECT_EQ(script.out().fault, ProgramFault::kNone);
}

TEST_P(ScriptLaw, ModesThatDoNotExistHoldAndDoNotArm) {
  for (const std::int32_t mode : {-1, 2, 3, 8, 10, std::numeric_limits<std::int32_t>::min()}) {
    ScriptRunner script = runner();
    script.arm();
    script.send(mode, kStart + Vector6::Constant(0.05));
    EXPECT_EQ(script.out().state, ProgramState::kHold);
    for (int i = 0; i < 50; ++i) script.send(1, kStart + Vector6::Constant(0.05));
    EXPECT_EQ(script.q(), kStart) << "mode " << mode;
  }
}

TEST_P(ScriptLaw, AStepOfOneRadianKeepsTheLimitsAndDoesNotOvershoot) {
  const rtde::ControlScriptConfig limits;
  ScriptRunner script = runner(Vector6::Zero());
  script.arm();
  Vector6 qd = Vector6::Zero();
  Vector6 q = script.q();
  double overshoot = 0.0;
  for (int i = 0; i < cycles(4.0); ++i) {
    script.send(1, Vector6::Constant(1.0));
    const Vector6 now = (script.q() - q) / script.cycle_s();
    for (int k = 0; k < 6; ++k) {
      ASSERT_LE(std::abs(now[k]), limits.max_velocity_rad_s[k] + 1e-12);
      ASSERT_LE(std::abs(now[k] - qd[k]), limits.max_acceleration_rad_s2[k] * script.cycle_s() + 1e-12)
          << "joint " << k;
    }
    overshoot = std::max(overshoot, script.q().maxCoeff() - 1.0);
    qd = now;
    q = script.q();
  }
  EXPECT_LT((script.q() - Vector6::Constant(1.0)).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT(overshoot, 1e-12);
}

TEST_P(ScriptLaw, NoRegisterValuesBreakTheLimitsOrTheRange) {
  rtde::ControlScriptConfig config;
  config.min_angle_rad = kStart - Vector6::Constant(0.3);
  config.max_angle_rad = kStart + Vector6::Constant(0.3);
  int tracking = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Adversary adversary(seed);
    ScriptRunner script = runner(kStart, config);
    Vector6 q = kStart;
    Vector6 qd = Vector6::Zero();
    for (int i = 0; i < 4000; ++i) {
      ASSERT_EQ(script.step(adversary(q)), Outcome::kRunning) << "seed " << seed;
      const Vector6 now = (script.q() - q) / script.cycle_s();
      for (int k = 0; k < 6; ++k) {
        ASSERT_LE(std::abs(now[k]), config.max_velocity_rad_s[k] + 1e-9) << "seed " << seed;
        ASSERT_LE(std::abs(now[k] - qd[k]), config.max_acceleration_rad_s2[k] * script.cycle_s() + 1e-9)
            << "seed " << seed << " cycle " << i;
        ASSERT_LE(std::abs(script.q()[k] - kStart[k]), 0.3 + 1e-12) << "seed " << seed << " cycle " << i;
      }
      q = script.q();
      qd = now;
      tracking += script.out().state == ProgramState::kTracking ? 1 : 0;
    }
  }
  EXPECT_GT(tracking, 5'000) << "the values must get past arming, or this proves nothing";
}

TEST_P(ScriptLaw, FeedForwardIntoTheEndOfTheRangeStopsThere) {
  rtde::ControlScriptConfig config;
  config.max_angle_rad.setConstant(0.5);
  ScriptRunner script = runner(Vector6::Zero(), config);
  script.arm();
  for (int i = 0; i < cycles(3.0); ++i) {
    script.send(1, Vector6::Constant(0.5), Vector6::Constant(0.99));
    ASSERT_LE(script.q().maxCoeff(), 0.5 + 1e-12);
  }
  EXPECT_GT(script.q().minCoeff(), 0.499);
}

TEST_P(ScriptLaw, FeedForwardRemovesTheLagOfASine) {
  constexpr double kAmplitude = 0.3;
  constexpr double kOmega = 2.0 * std::numbers::pi * 0.5;
  ScriptRunner script = runner(Vector6::Zero());
  script.arm();
  double worst = 0.0;
  for (int i = 0; i < cycles(6.0); ++i) {
    const double t = i * script.cycle_s();
    const Vector6 q = Vector6::Constant(kAmplitude * std::sin(kOmega * t));
    script.send(1, q, Vector6::Constant(kAmplitude * kOmega * std::cos(kOmega * t)));
    if (t > 2.0) worst = std::max(worst, (script.q() - q).cwiseAbs().maxCoeff());
  }
  RecordProperty("worst_rad", std::to_string(worst));
  EXPECT_LE(worst, GetParam() == 2 ? 0.005 : 0.01);
}

TEST_P(ScriptLaw, ASenderThatHangsIsNoticedWithin50MsAndTheArmBrakesAndStays) {
  ScriptRunner script = runner(Vector6::Zero());
  script.arm();
  for (int i = 0; i < cycles(0.6); ++i) script.send(1, Vector6::Constant(3.0));
  ASSERT_NEAR(script.qd()[0], 1.0, 1e-9);
  int fresh = 0;
  while (script.repeat(), script.out().state == ProgramState::kTracking) ASSERT_LT(++fresh, 1000);
  EXPECT_EQ(fresh, GetParam() == 2 ? 24 : 5);  // 50 ms, or the six cycles that come closest
  EXPECT_EQ(script.out().fault, ProgramFault::kStale);
  const double from = script.q()[0];
  for (int i = 0; i < cycles(0.26); ++i) script.repeat();  // 1 rad/s at 4 rad/s2: a quarter of a second
  EXPECT_NEAR(script.q()[0] - from, 0.125, 0.002 + 1.5 * script.cycle_s());
  const Vector6 rest = script.q();
  for (int i = 0; i < cycles(0.5); ++i) script.repeat();
  EXPECT_EQ(script.q(), rest);
  for (int i = 0; i < cycles(0.2); ++i) script.send(1, rest + Vector6::Constant(0.01));
  EXPECT_EQ(script.q(), rest) << "fresh commands alone must not resume";
  EXPECT_EQ(script.out().state, ProgramState::kStale);
  script.arm();
}

TEST_P(ScriptLaw, ASequenceThatOnlyRepeatsDoesNotCountAsFresh) {
  ScriptRunner script = runner();
  RegisterInputs in{0, 0, kStart, Vector6::Zero(), 1};
  script.step(in);
  in.mode = 1;
  in.q_target_rad += Vector6::Constant(0.05);
  for (int i = 0; i < 100; ++i, ++in.packages) script.step(in);
  EXPECT_EQ(script.q(), kStart);
}

TEST_P(ScriptLaw, WithoutPackagesTheWatchdogEndsItAfter100Ms) {
  ScriptRunner script = runner();
  script.arm();
  int silent = 0;
  while (script.starve() == Outcome::kRunning) ASSERT_LT(++silent, 1000);
  EXPECT_NEAR(silent * script.cycle_s(), 0.1, script.cycle_s());
  EXPECT_TRUE(script.program().watchdog_fired());
  EXPECT_EQ(script.program().motion().kind, RobotMotion::Kind::kNone);
}

TEST_P(ScriptLaw, PackagesThatOnlyRepeatKeepItAlive) {
  ScriptRunner script = runner();
  for (int i = 0; i < cycles(2.0); ++i) ASSERT_EQ(script.repeat(), Outcome::kRunning);
}

TEST_P(ScriptLaw, ExitStopsTheArmAndEndsTheProgram) {
  ScriptRunner script = runner(Vector6::Zero());
  script.arm();
  for (int i = 0; i < cycles(0.2); ++i) script.send(1, Vector6::Constant(1.0));
  const Vector6 at = script.q();
  EXPECT_EQ(script.send(9, Vector6::Zero()), Outcome::kRunning);
  EXPECT_EQ(script.program().motion().kind, RobotMotion::Kind::kStop);
  EXPECT_EQ(script.out().state, ProgramState::kEnded);
  EXPECT_EQ(script.send(9, Vector6::Zero()), Outcome::kEnded);
  EXPECT_EQ(script.send(1, Vector6::Zero()), Outcome::kEnded);
  EXPECT_EQ(script.q(), at);
}

TEST_P(ScriptLaw, AfterSomethingElseMovedTheArmItStaysWhereItIsAndNeedsArming) {
  ScriptRunner script = runner(Vector6::Zero());
  script.arm();
  for (int i = 0; i < cycles(0.5); ++i) script.send(1, Vector6::Constant(1.0));
  const Vector6 elsewhere = script.q() - Vector6::Constant(0.3);
  script.displace(elsewhere);
  for (int i = 0; i < cycles(0.5); ++i) script.send(1, Vector6::Constant(1.0));
  EXPECT_EQ(script.q(), elsewhere);
  EXPECT_EQ(script.out().fault, ProgramFault::kMoved);
  EXPECT_EQ(script.out().state, ProgramState::kHold);
  script.arm();
}

TEST_P(ScriptLaw, ItNeverComesNearTheControllersTimeBudgetNorAllocates) {
  ScriptRunner script = runner();
  script.arm();
  const auto before = test::heap_allocations();
  for (int i = 0; i < 500; ++i) ASSERT_EQ(script.send(1, kStart), Outcome::kRunning);
  EXPECT_EQ(test::heap_allocations(), before);
}

}  // namespace
}  // namespace embody::sim
