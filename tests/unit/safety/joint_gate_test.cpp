#include "core/safety/joint_gate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>

#include "tests/support/heap_counter.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::safety {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

JointLimits demo_limits() {
  JointLimits limits;
  limits.speed_rad_s << 1.0, 1.0, 1.5, 2.0, 2.0, 2.0;
  limits.acceleration_rad_s2 << 4.0, 4.0, 6.0, 10.0, 10.0, 10.0;
  return limits;
}

/// Anything that a broken caller could pass: usual, huge, infinite, not a number.
double any_number(test::RandomValues& random) {
  const double kind = random(0.0, 1.0);
  if (kind < 0.01) return kNan;
  if (kind < 0.02) return random(0.0, 1.0) < 0.5 ? kInf : -kInf;
  if (kind < 0.05) return random(-1.0, 1.0) * 1e308;
  if (kind < 0.10) return random(-1.0, 1.0) * 1e3;
  return random(-3.0, 3.0);
}

Vector6 any_vector(test::RandomValues& random) {
  Vector6 v;
  for (int i = 0; i < 6; ++i) v[i] = any_number(random);
  return v;
}

TEST(JointGate, SpeedAndAccelerationStayInsideTheirLimitsForAnyTargetAndAnyTick) {
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    test::RandomValues random(seed);
    JointGate gate(demo_limits());
    gate.reset(random.vector<6>(-3.0, 3.0));
    Vector6 target = Vector6::Zero();
    Vector6 feed_forward = Vector6::Zero();
    for (int i = 0; i < 25'000; ++i) {
      if (random(0.0, 1.0) < 0.3) target = any_vector(random);
      if (random(0.0, 1.0) < 0.3) feed_forward = any_vector(random);
      const double dt_s = random(0.002, 0.020);
      const Vector6 q = gate.q_rad();
      const Vector6 qd = gate.qd_rad_s();
      if (random(0.0, 1.0) < 0.05) {
        gate.brake(dt_s);
      } else {
        gate.follow(target, feed_forward, dt_s);
      }
      ASSERT_TRUE(gate.q_rad().allFinite() && gate.qd_rad_s().allFinite()) << "tick " << i;
      ASSERT_TRUE((gate.qd_rad_s().array().abs() <= gate.limits().speed_rad_s.array()).all()) << "tick " << i;
      const Vector6 most = gate.limits().acceleration_rad_s2 * dt_s * (1.0 + 1e-12);
      ASSERT_TRUE(((gate.qd_rad_s() - qd).array().abs() <= most.array()).all()) << "tick " << i;
      ASSERT_LT((q + gate.qd_rad_s() * dt_s - gate.q_rad()).cwiseAbs().maxCoeff(), 1e-12) << "speed is not the motion";
    }
  }
}

/// How far the gate leaves the joint limits while targets with `feed_forward` times a random speed come and go.
double largest_excess(std::uint64_t seed, double feed_forward, double shortest_tick_s, double longest_tick_s) {
  test::RandomValues random(seed);
  JointLimits limits = demo_limits();
  limits.lower_rad.setConstant(-1.0);
  limits.upper_rad.setConstant(1.0);
  JointGate gate(limits);
  gate.reset(random.vector<6>(-1.0, 1.0));
  Vector6 target = Vector6::Zero();
  Vector6 qd_d = Vector6::Zero();
  double excess = 0.0;
  for (int i = 0; i < 100'000; ++i) {
    if (random(0.0, 1.0) < 0.01) {
      target = random.vector<6>(-3.0, 3.0);
      qd_d = feed_forward * random.vector<6>(-1.0, 1.0);
      if (random(0.0, 1.0) < 0.1) target[0] = kNan;
    }
    gate.follow(target, qd_d, random(shortest_tick_s, longest_tick_s));
    excess = std::max(excess, gate.q_rad().cwiseAbs().maxCoeff() - 1.0);
  }
  return excess;
}

TEST(JointGate, StaysInsideTheJointLimitsWithoutFeedForward) {
  for (const double tick_s : {0.002, 0.008, 0.020}) {
    EXPECT_LE(largest_excess(11, 0.0, tick_s, tick_s), 1e-9) << "tick " << tick_s << " s";
  }
}

TEST(JointGate, StaysInsideTheJointLimitsWhenTicksDifferInLength) {
  for (const std::uint64_t seed : {11, 12, 13, 14}) {
    EXPECT_LE(largest_excess(seed, 0.0, 0.002, 0.020), 1e-9) << "seed " << seed;
  }
}

TEST(JointGate, StaysInsideTheJointLimitsWithAnyFeedForward) {
  for (const std::uint64_t seed : {21, 22, 23}) {
    EXPECT_LE(largest_excess(seed, 2.0, 0.002, 0.002), 1e-9) << "seed " << seed;
  }
}

TEST(JointGate, StopsAtTheJointLimitWhenATargetRunsIntoIt) {
  JointLimits limits = demo_limits();
  limits.upper_rad.setConstant(1.0);
  JointGate gate(limits);
  gate.reset(Vector6::Zero());
  constexpr double kTick_s = 0.002;
  const Vector6 speed = 0.8 * limits.speed_rad_s;
  double highest = -kInf;
  for (double t = 0.0; t < 3.0; t += kTick_s) {  // the target ends at the limit, and so does its speed
    const Vector6 wanted = speed * t;
    const Vector6 target = wanted.cwiseMin(limits.upper_rad);
    const Vector6 qd_d = (wanted.array() < limits.upper_rad.array()).select(speed, Vector6::Zero());
    gate.follow(target, qd_d, kTick_s);
    highest = std::max(highest, gate.q_rad().maxCoeff());
  }
  EXPECT_LE(highest, 1.0 + 1e-9);
}

TEST(JointGate, BrakesBeforeTheTargetAfterATickThatWasLong) {
  double worst = 0.0;
  for (int start = 0; start < 400; ++start) {  // phase at which the long tick comes
    JointGate gate(demo_limits());
    gate.reset(Vector6::Zero());
    const Vector6 target = Vector6::Constant(0.3);
    for (int i = 0; i < 2000; ++i) {
      gate.follow(target, Vector6::Zero(), i % 400 == start ? 0.020 : 0.002);
      worst = std::max(worst, (gate.q_rad() - target).maxCoeff());
    }
  }
  EXPECT_LE(worst, 1e-9);
}

TEST(JointGate, ReachesAConstantTargetFromRestWithoutOvershoot) {
  test::RandomValues random(31);
  for (int run = 0; run < 300; ++run) {
    JointGate gate(demo_limits());
    const Vector6 start = random.vector<6>(-3.0, 3.0);
    const Vector6 target = run % 3 == 0 ? Vector6(start + random.vector<6>(-0.01, 0.01)) : random.vector<6>(-3.0, 3.0);
    gate.reset(start);
    const int kind = run % 4;
    double t_s = 0.0;
    while (t_s < 12.0) {
      const double dt_s = kind == 0 ? 0.002 : kind == 1 ? 0.008 : kind == 2 ? 0.020 : random(0.002, 0.020);
      gate.follow(target, Vector6::Zero(), dt_s);
      t_s += dt_s;
      for (int i = 0; i < 6; ++i) {
        const double beyond = (gate.q_rad()[i] - target[i]) * (target[i] > start[i] ? 1.0 : -1.0);
        ASSERT_LE(beyond, 1e-9) << "run " << run << " joint " << i << " at " << t_s << " s";
      }
    }
    ASSERT_LT((gate.q_rad() - target).cwiseAbs().maxCoeff(), 1e-9) << "run " << run;
  }
}

TEST(JointGate, IsAtRestWhereItIsResetWhateverItDidBefore) {
  JointGate gate(demo_limits());
  gate.reset(Vector6::Zero());
  for (int i = 0; i < 200; ++i) gate.follow(Vector6::Constant(2.0), Vector6::Zero(), 0.002);
  ASSERT_FALSE(gate.at_rest());
  const Vector6 here = Vector6::Constant(0.7);
  gate.reset(here);
  EXPECT_TRUE(gate.at_rest());
  EXPECT_EQ(gate.q_rad(), here);
  gate.brake(0.002);
  EXPECT_EQ(gate.q_rad(), here);
}

TEST(JointGate, BrakesToExactlyZeroOnTheShortestWayFromAnySpeed) {
  test::RandomValues random(41);
  for (int run = 0; run < 200; ++run) {
    JointGate gate(demo_limits());
    gate.reset(Vector6::Zero());
    const Vector6 target = random.vector<6>(-3.0, 3.0);
    for (int i = 0; i < 1 + run; ++i) gate.follow(target, Vector6::Zero(), 0.002);
    const Vector6 q_0 = gate.q_rad();
    const Vector6 qd_0 = gate.qd_rad_s();
    const double dt_s = random(0.002, 0.020);
    int ticks = 0;
    while (!gate.at_rest() && ticks < 1000) {
      gate.brake(dt_s);
      ++ticks;
      ASSERT_TRUE((gate.qd_rad_s().array() * qd_0.array() >= 0.0).all()) << "turned round while braking";
    }
    EXPECT_TRUE(gate.qd_rad_s().isZero(0.0));
    const Vector6& a = gate.limits().acceleration_rad_s2;
    EXPECT_LE(ticks * dt_s, (qd_0.cwiseAbs().array() / a.array()).maxCoeff() + 1.001 * dt_s);
    const Vector6 way = (gate.q_rad() - q_0).cwiseAbs();
    EXPECT_TRUE((way.array() <= 0.5 * qd_0.array().square() / a.array() + 1e-9).all()) << way.transpose();
  }
}

TEST(JointGate, FollowsASineWithFeedForwardWithinFiveMilliradians) {
  for (const double dt_s : {0.002, 0.008}) {
    JointGate gate(demo_limits());
    constexpr double kAmplitude = 0.3;
    constexpr double kOmega = 2.0 * M_PI * 0.5;
    const auto sine = [](double t_s) { return -kAmplitude * std::cos(kOmega * t_s); };  // begins at rest
    gate.reset(Vector6::Constant(sine(0.0)));
    double largest = 0.0;
    for (double t = 0.0; t < 10.0; t += dt_s) {
      gate.follow(Vector6::Constant(sine(t)), Vector6::Constant(kAmplitude * kOmega * std::sin(kOmega * t)), dt_s);
      // The set-point is where the target will be when this tick is over.
      largest = std::max(largest, (gate.q_rad().array() - sine(t + dt_s)).abs().maxCoeff());
    }
    std::printf("tick %.0f ms: largest error %.3f mrad\n", dt_s * 1e3, largest * 1e3);
    EXPECT_LT(largest, 0.005) << "tick " << dt_s << " s";
  }
}

TEST(JointGate, BrakesOnATargetThatIsNotFinite) {
  for (const double bad : {kNan, kInf, -kInf}) {
    for (const bool in_feed_forward : {false, true}) {
      JointGate gate(demo_limits());
      gate.reset(Vector6::Zero());
      for (int i = 0; i < 200; ++i) gate.follow(Vector6::Constant(2.0), Vector6::Zero(), 0.002);
      JointGate braking = gate;
      Vector6 target = Vector6::Constant(2.0);
      Vector6 feed_forward = Vector6::Zero();
      (in_feed_forward ? feed_forward : target)[3] = bad;
      gate.follow(target, feed_forward, 0.002);
      braking.brake(0.002);
      EXPECT_EQ(gate.q_rad(), braking.q_rad());
      EXPECT_EQ(gate.qd_rad_s(), braking.qd_rad_s());
    }
  }
}

TEST(JointGate, ReturnsFromBeyondTheJointLimitsAtLimitedSpeed) {
  JointLimits limits = demo_limits();
  limits.upper_rad.setConstant(1.0);
  JointGate gate(limits);
  gate.reset(Vector6::Constant(1.5));
  for (int i = 0; i < 3000; ++i) {
    const Vector6 q = gate.q_rad();
    gate.follow(Vector6::Constant(3.0), Vector6::Constant(1.0), 0.002);
    ASSERT_TRUE((gate.q_rad().array() <= q.array()).all()) << "moved further out";
  }
  EXPECT_LT((gate.q_rad() - Vector6::Ones()).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(JointGate, UsesNoHeap) {
  JointGate gate(demo_limits());
  gate.reset(Vector6::Zero());
  const std::uint64_t before = test::heap_allocations();
  for (int i = 0; i < 100; ++i) gate.follow(Vector6::Ones(), Vector6::Zero(), 0.002);
  gate.brake(0.002);
  EXPECT_EQ(test::heap_allocations(), before);
}

}  // namespace
}  // namespace embody::safety
