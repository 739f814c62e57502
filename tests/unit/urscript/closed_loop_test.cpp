// A minute of the shipped control program in virtual time, every cycle of it: commands reach the robot one to three
// cycles after the package that they answer, as over a network.
#include <gtest/gtest.h>

#include <deque>
#include <random>
#include <vector>

#include "drivers/sim/ur/ur_robot.hpp"
#include "tests/support/closed_loop.hpp"

namespace embody::sim {
namespace {

using test::CycleSample;
using test::Sine;

constexpr double kCycle_s = 0.002;
constexpr Duration kCycle = std::chrono::milliseconds(2);

/// The robot and a sender whose commands take 1 to 3 cycles, in order.
class Loop {
 public:
  explicit Loop(std::uint64_t seed) : random_(seed) { robot_.step(inputs_, kCycle); }

  void cycle(std::int32_t mode, const Vector6& q_rad, const Vector6& qd_rad_s) {
    const std::uint64_t delay = 1 + random_() % 3;
    ++sequence_;
    arrival_ = std::max(arrival_, now_ + delay);
    on_the_way_.push_back({arrival_, {sequence_, mode, q_rad, qd_rad_s, static_cast<std::uint64_t>(sequence_)}});
    ++now_;
    while (!on_the_way_.empty() && on_the_way_.front().arrival <= now_) {
      inputs_ = on_the_way_.front().inputs;
      on_the_way_.pop_front();
    }
    robot_.step(inputs_, kCycle);
    worst_echo_ = std::max(worst_echo_, sequence_ - robot_.registers().sequence);
  }
  void arm() {
    for (int i = 0; i < 6; ++i) cycle(0, Vector6::Zero(), Vector6::Zero());
    for (int i = 0; i < 6; ++i) cycle(1, robot_.q_rad(), Vector6::Zero());
    ASSERT_EQ(robot_.registers().state, ProgramState::kTracking);
    worst_echo_ = 0;
  }
  [[nodiscard]] CycleSample sample(double t_s) const {
    return {t_s, robot_.q_target_rad(), robot_.q_rad(), robot_.qd_rad_s()};
  }
  [[nodiscard]] const UrRobot& robot() const { return robot_; }
  [[nodiscard]] int worst_echo() const { return worst_echo_; }

 private:
  struct Package {
    std::uint64_t arrival{0};
    RegisterInputs inputs;
  };
  UrRobot robot_{UrRobotConfig{}};
  RegisterInputs inputs_;
  std::deque<Package> on_the_way_;
  std::mt19937_64 random_;
  std::uint64_t now_{0};
  std::uint64_t arrival_{0};
  std::int32_t sequence_{0};
  int worst_echo_{0};
};

TEST(ClosedLoop, FollowsAMinuteOfSineWithinFiveMilliradians) {
  constexpr std::uint64_t kSeed = 20240607;
  SCOPED_TRACE(kSeed);
  Loop loop(kSeed);
  loop.arm();
  Sine sine;
  sine.centre_rad = loop.robot().q_rad();
  std::vector<CycleSample> samples;
  for (int i = 0; i < 30'000; ++i) {
    const double t_s = i * kCycle_s;
    loop.cycle(1, sine.q_rad(t_s), sine.qd_rad_s(t_s));
    ASSERT_EQ(loop.robot().registers().state, ProgramState::kTracking) << "cycle " << i;
    samples.push_back(loop.sample(t_s + kCycle_s));
  }
  const test::SineFollowing result = test::judge_sine(samples, sine);
  std::printf("echo after at most %d cycles; set-point within %.5f rad; joints within %.5f rad at %.1f ms lag\n",
              loop.worst_echo(), result.target_error_rad, result.joint_error_rad, result.lag_s * 1e3);
  EXPECT_LE(loop.worst_echo(), 3);
  EXPECT_LE(result.target_error_rad, 0.005);
  EXPECT_LE(result.joint_error_rad, 0.005);
  EXPECT_LE(result.lag_s, 0.1);
}

TEST(ClosedLoop, AStepOfOneRadianKeepsTheLimitsInTheJointsThemselves) {
  constexpr std::uint64_t kSeed = 5;
  SCOPED_TRACE(kSeed);
  Loop loop(kSeed);
  loop.arm();
  const Vector6 start = loop.robot().q_rad();
  const Vector6 goal = start + Vector6::Constant(1.0);
  std::vector<CycleSample> samples;
  for (int i = 0; i < 2'000; ++i) {
    loop.cycle(1, goal, Vector6::Zero());
    samples.push_back(loop.sample((i + 1) * kCycle_s));
  }
  const test::StepFollowing result = test::judge_step(samples, start, goal, kCycle_s);
  const rtde::ControlScriptConfig limits;
  EXPECT_LE((result.speed_rad_s - limits.max_velocity_rad_s).maxCoeff(), 1e-9);
  EXPECT_LE((result.acceleration_rad_s2 - limits.max_acceleration_rad_s2).maxCoeff(), 1e-6);
  EXPECT_LE(result.overshoot_rad.maxCoeff(), 1e-6);
  EXPECT_GT(result.settled_s, 1.0) << "1 rad at 1 rad/s takes a second at least";
  EXPECT_LT(result.settled_s, 2.0);
}

}  // namespace
}  // namespace embody::sim
