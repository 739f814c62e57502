#include "drivers/sim/ur/register_program.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

namespace embody::sim {
namespace {

constexpr Duration kCycle = std::chrono::milliseconds(2);
constexpr double kCycle_s = 0.002;
const Vector6 kStart{0.1, -1.2, 1.4, -1.5, -1.6, 0.3};

/// The program with a sender that changes the sequence in each cycle.
class Program {
 public:
  explicit Program(const Vector6& q = kStart) { program_.start(q, 0); }
  const RegisterOutputs& send(std::int32_t mode, const Vector6& q, const Vector6& qd = Vector6::Zero()) {
    return program_.step(last_ = {last_.sequence + 1, mode, q, qd}, kCycle);
  }
  /// A cycle in which nothing new arrived.
  const RegisterOutputs& starve() { return program_.step(last_, kCycle); }
  void arm() {
    send(0, Vector6::Zero());
    send(1, program_.outputs().q_rad);
    ASSERT_EQ(outputs().state, ProgramState::kTracking);
  }
  const RegisterOutputs& outputs() const { return program_.outputs(); }

 private:
  RegisterProgram program_{RegisterProgramConfig{}};
  RegisterInputs last_;
};

TEST(RegisterProgram, ModeOneWithoutModeZeroBeforeNeverMoves) {
  Program program;
  for (int i = 0; i < 500; ++i) program.send(1, kStart + Vector6::Constant(0.05));
  EXPECT_EQ(program.outputs().q_rad, kStart);
  EXPECT_NE(program.outputs().state, ProgramState::kTracking);
}

TEST(RegisterProgram, ZeroRegistersNeverMove) {
  Program program;
  for (int i = 0; i < 500; ++i) program.starve();
  for (int i = 0; i < 500; ++i) program.send(0, Vector6::Zero());
  for (int i = 0; i < 500; ++i) program.send(1, Vector6::Zero());  // armed, but far away
  EXPECT_EQ(program.outputs().q_rad, kStart);
  EXPECT_EQ(program.outputs().fault, ProgramFault::kFarTarget);
}

TEST(RegisterProgram, NotANumberNeverMoves) {
  for (int joint = 0; joint < 6; ++joint) {
    Program program;
    program.send(0, Vector6::Zero());
    Vector6 q = kStart;
    q[joint] = std::nan("");
    for (int i = 0; i < 500; ++i) program.send(1, q);
    EXPECT_EQ(program.outputs().q_rad, kStart);
    EXPECT_EQ(program.outputs().fault, ProgramFault::kOutOfRange);
    program.arm();
    for (int i = 0; i < 500; ++i) program.send(1, q, Vector6::Constant(std::nan("")));
    EXPECT_EQ(program.outputs().q_rad, kStart) << "keeps the last good target";
    EXPECT_EQ(program.outputs().state, ProgramState::kTracking);
  }
}

TEST(RegisterProgram, AFarFirstTargetNeedsModeZeroAgain) {
  Program program;
  program.send(0, kStart);
  program.send(1, kStart + Vector6::Constant(0.11));
  EXPECT_EQ(program.outputs().fault, ProgramFault::kFarTarget);
  for (int i = 0; i < 10; ++i) program.send(1, kStart);
  EXPECT_EQ(program.outputs().state, ProgramState::kHold);
  program.arm();
  EXPECT_EQ(program.outputs().fault, ProgramFault::kNone);
}

TEST(RegisterProgram, ModesThatDoNotExistHoldAndDoNotArm) {
  for (const std::int32_t mode : {-1, 3, 8, 10, std::numeric_limits<std::int32_t>::min()}) {
    Program program;
    program.arm();
    program.send(mode, kStart + Vector6::Constant(0.05));
    EXPECT_EQ(program.outputs().state, ProgramState::kHold);
    for (int i = 0; i < 100; ++i) program.send(1, kStart + Vector6::Constant(0.05));
    EXPECT_EQ(program.outputs().q_rad, kStart) << "mode " << mode;
  }
}

TEST(RegisterProgram, PoseTargetsAreAnsweredWithTheInverseKinematicsFault) {
  Program program;
  program.arm();
  program.send(2, kStart);
  EXPECT_EQ(program.outputs().fault, ProgramFault::kNoInverse);
}

TEST(RegisterProgram, AStepIsReachedWithinTheLimitsAndWithoutOvershoot) {
  Program program(Vector6::Zero());
  program.arm();
  double overshoot = 0.0;
  for (int i = 0; i < 3000; ++i) {
    program.send(1, Vector6::Constant(1.0));
    overshoot = std::max(overshoot, program.outputs().q_rad.maxCoeff() - 1.0);
  }
  EXPECT_LT((program.outputs().q_rad - Vector6::Constant(1.0)).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT(overshoot, 1e-9);
}

TEST(RegisterProgram, FeedForwardRemovesTheLagOfASine) {
  constexpr double kAmplitude = 0.3;
  constexpr double kOmega = 2.0 * 3.14159265 * 0.5;
  Program program(Vector6::Zero());
  program.arm();
  double worst = 0.0;
  for (int i = 0; i < 3000; ++i) {
    const double t = i * kCycle_s;
    const Vector6 q = Vector6::Constant(kAmplitude * std::sin(kOmega * t));
    program.send(1, q, Vector6::Constant(kAmplitude * kOmega * std::cos(kOmega * t)));
    if (t > 2.0) worst = std::max(worst, (program.outputs().q_rad - q).cwiseAbs().maxCoeff());
  }
  EXPECT_LT(worst, 0.004);
}

TEST(RegisterProgram, AStarvingProgramBrakesWithinItsLimitsAndStaysUntilArmedAgain) {
  Program program(Vector6::Zero());
  program.arm();
  for (int i = 0; i < 300; ++i) program.send(1, Vector6::Constant(3.0));
  ASSERT_NEAR(program.outputs().qd_rad_s[0], 1.0, 1e-9);
  int cycles_until_stale = 0;
  while (program.starve().state == ProgramState::kTracking) ++cycles_until_stale;
  EXPECT_EQ(cycles_until_stale, 24);  // fresh for less than 50 ms
  const double from = program.outputs().q_rad[0];
  for (int i = 0; i < 126; ++i) program.starve();  // 1 rad/s at 4 rad/s2: a quarter of a second
  EXPECT_EQ(program.outputs().qd_rad_s, Vector6(Vector6::Zero()));
  EXPECT_NEAR(program.outputs().q_rad[0] - from, 0.125, 0.005);
  EXPECT_EQ(program.outputs().fault, ProgramFault::kStale);
  const Vector6 rest = program.outputs().q_rad;
  for (int i = 0; i < 100; ++i) program.send(1, rest + Vector6::Constant(0.01));
  EXPECT_EQ(program.outputs().q_rad, rest) << "fresh commands alone must not resume";
  EXPECT_EQ(program.outputs().state, ProgramState::kStale);
  program.arm();
}

TEST(RegisterProgram, ASequenceThatOnlyRepeatsDoesNotCountAsFresh) {
  RegisterProgram program{RegisterProgramConfig{}};
  program.start(kStart, 7);
  program.step({7, 0, kStart, Vector6::Zero()}, kCycle);
  for (int i = 0; i < 100; ++i) program.step({7, 1, kStart + Vector6::Constant(0.05), Vector6::Zero()}, kCycle);
  EXPECT_EQ(program.outputs().q_rad, kStart);
}

TEST(RegisterProgram, ExitBrakesAndEndsForGood) {
  Program program(Vector6::Zero());
  program.arm();
  for (int i = 0; i < 100; ++i) program.send(1, Vector6::Constant(1.0));
  for (int i = 0; i < 200; ++i) program.send(9, Vector6::Zero());
  EXPECT_EQ(program.outputs().state, ProgramState::kEnded);
  const Vector6 rest = program.outputs().q_rad;
  for (int i = 0; i < 10; ++i) program.send(0, rest);
  for (int i = 0; i < 10; ++i) program.send(1, rest + Vector6::Constant(0.01));
  EXPECT_EQ(program.outputs().q_rad, rest);
}

/// Register values of every kind: near, far, huge, not a number, any bit pattern.
class Adversary {
 public:
  explicit Adversary(unsigned seed) : random_(seed) {}
  RegisterInputs operator()(const Vector6& q) {
    RegisterInputs in;
    if (pick(8) != 0) ++sequence_;
    constexpr std::array<std::int32_t, 8> kModes{0, 0, 0, 1, 2, -1, 3, 1 << 30};
    if (pick(100) == 0) mode_ = kModes[pick(kModes.size())];
    if (mode_ != 1 && pick(4) == 0) mode_ = 1;
    if (pick(20'000) == 0) mode_ = 9;
    in.sequence = sequence_;
    in.mode = mode_;
    wild_ = pick(10) == 0;
    for (int i = 0; i < 6; ++i) {
      in.q_target_rad[i] = number(q[i]);
      in.qd_target_rad_s[i] = number(0.0);
    }
    return in;
  }

 private:
  std::uint64_t pick(std::uint64_t n) { return random_() % n; }
  double number(double near) {
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    if (!wild_) return near + 0.05 * unit(random_);
    switch (pick(20)) {
      case 0:
        return std::nan("");
      case 1:
        return std::numeric_limits<double>::infinity();
      case 2:
        return std::bit_cast<double>(random_());
      case 3:
        return 1e300;
      default:
        return pick(3) == 0 ? 7.0 * unit(random_) : near + 0.05 * unit(random_);
    }
  }
  std::mt19937_64 random_;
  std::int32_t sequence_{0};
  std::int32_t mode_{0};
  bool wild_{false};
};

TEST(RegisterProgram, NoRegisterValuesBreakTheVelocityAndAccelerationLimits) {
  const RegisterProgramConfig config;
  int tracking = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Adversary adversary(seed);
    RegisterProgram program(config);
    program.start(kStart, 0);
    RegisterOutputs before = program.outputs();
    for (int cycle = 0; cycle < 5000; ++cycle) {
      const RegisterOutputs& now = program.step(adversary(before.q_rad), kCycle);
      for (int i = 0; i < 6; ++i) {
        ASSERT_LE(std::abs(now.qd_rad_s[i]), config.max_velocity_rad_s[i] + 1e-12) << "seed " << seed;
        ASSERT_LE(std::abs(now.qd_rad_s[i] - before.qd_rad_s[i]), config.max_acceleration_rad_s2[i] * kCycle_s + 1e-12)
            << "seed " << seed << " cycle " << cycle;
        ASSERT_NEAR(now.q_rad[i], before.q_rad[i] + now.qd_rad_s[i] * kCycle_s, 1e-12);
      }
      tracking += now.state == ProgramState::kTracking ? 1 : 0;
      before = now;
    }
  }
  EXPECT_GT(tracking, 20'000) << "the values must get past arming, or this proves nothing";
}

}  // namespace
}  // namespace embody::sim
