#include "daemon/loops/arm_loop.hpp"

#include <gtest/gtest.h>

#include "core/teleop/clock_map.hpp"
#include "tests/unit/loops/arm_bench.hpp"

namespace embody {
namespace {

using safety::Cause;
using safety::Mode;
using safety::RequestKind;
using std::chrono::milliseconds;
using test::ArmBench;
using test::engaged_script;
using test::FakeArm;
using test::patient;
using test::patient_modes;

TEST(ArmLoop, AnswersEachPackageWithExactlyOneCommandInOrder) {
  ArmBench bench;
  constexpr std::uint64_t kPackages = 3000;
  bench.arm.script = [&] {
    if (bench.arm.state.package == kPackages) {
      bench.shut_down();
      return IoStatus::kEmpty;
    }
    return IoStatus::kDone;  // a backlog: the next one is always there
  };
  // After the shutdown request the loop waits for one more package to see that nothing moves: it gets none.
  EXPECT_EQ(bench.run(), 0U) << "heap uses";
  ASSERT_EQ(bench.arm.answers.size(), kPackages);
  teleop::ClockMap robot_clock;  // a stall of this machine makes a package late, not its measurement
  Duration controller_time = bench.arm.state.controller_time - static_cast<int>(kPackages) * bench.arm.period;
  for (std::size_t i = 0; i < kPackages; ++i) {
    const FakeArm::Answer& answer = bench.arm.answers[i];
    controller_time += bench.arm.period;
    ASSERT_EQ(answer.package, i + 1) << "answered late, twice or never";
    ASSERT_EQ(answer.command.sequence, i + 1);
    ASSERT_EQ(answer.command.action, ArmAction::kHold) << "nobody asked for motion";
    ASSERT_EQ(answer.command.t_expires,
              robot_clock.map(controller_time, answer.t_arrival) + patient().command_lifetime);
  }
  EXPECT_EQ(bench.edges.counters.robot_packages, kPackages);
  EXPECT_EQ(bench.edges.counters.arm_commands, kPackages);
  EXPECT_EQ(bench.edges.counters.arm_commands_dropped, 0U);
  EXPECT_TRUE(bench.edges.arm_finished);
}

TEST(ArmLoop, WorksOffABacklogThatOnlyTheDriverKnowsOf) {
  ArmBench bench;
  const test::EventFd silent{false};  // all bytes have left the socket already
  bench.arm.fd = silent.get();
  constexpr std::uint64_t kPackages = 100;
  bench.arm.script = [&] {
    if (bench.arm.state.package < kPackages) return IoStatus::kDone;
    bench.shut_down();
    return IoStatus::kEmpty;
  };
  EXPECT_EQ(bench.run(), 0U) << "heap uses";
  ASSERT_EQ(bench.arm.answers.size(), kPackages);
  for (std::size_t i = 0; i < kPackages; ++i) ASSERT_EQ(bench.arm.answers[i].package, i + 1);
}

TEST(ArmLoop, CountsThePackagesThatTheRobotsClockShowsToBeMissing) {
  ArmBench bench;
  bench.arm.script = [&, n = 0]() mutable {
    if (++n == 50) bench.arm.state.controller_time += milliseconds(6);  // three are lost
    if (n == 100) bench.shut_down();
    return IoStatus::kDone;
  };
  bench.run();
  EXPECT_EQ(bench.edges.counters.robot_packages_skipped, 3U);
}

TEST(ArmLoop, GivesTheRobotConsecutiveNumbersAlthoughSomeCommandsAreNotSent) {
  ArmBench bench;
  bench.arm.on_write = [&, n = 0](const ArmCommand&) mutable {
    ++n;
    return n % 7 == 0 ? IoStatus::kRefused : n % 11 == 0 ? IoStatus::kEmpty : IoStatus::kDone;
  };
  bench.arm.script = [&] {
    if (bench.arm.state.package == 1000) bench.shut_down();
    return IoStatus::kDone;
  };
  bench.run();
  std::uint32_t last = 0;
  std::uint64_t dropped = 0;
  for (const FakeArm::Answer& answer : bench.arm.answers) {
    ASSERT_EQ(answer.command.sequence, last + 1) << "package " << answer.package;
    if (answer.accepted) ++last;
    if (!answer.accepted) ++dropped;
  }
  EXPECT_GT(dropped, 200U);
  EXPECT_EQ(bench.edges.counters.arm_commands_dropped, dropped);
  EXPECT_EQ(bench.edges.counters.arm_commands, last);
}

TEST(ArmLoop, LetsCommandsExpire) {
  ArmLoopConfig config = patient();
  config.command_lifetime = -milliseconds(1);
  ArmBench bench(config);
  bench.arm.script = [&] {
    if (bench.arm.state.package == 100) bench.shut_down();
    return IoStatus::kDone;
  };
  bench.run();
  EXPECT_EQ(bench.edges.counters.arm_commands, 0U);
  for (const FakeArm::Answer& answer : bench.arm.answers) ASSERT_EQ(answer.command.sequence, 1U);
}

/// Checks the joint limits of everything that was sent, from the first tracking command on.
void expect_limits(const ArmBench& bench) {
  test::LimitCheck check(bench.cell.joints, test::usual_posture());
  for (const FakeArm::Answer& answer : bench.arm.answers) {
    const teleop::ArmReference reference{Pose::Identity(), answer.command.q_rad, answer.command.qd_rad_s, true};
    ASSERT_EQ(check(reference, 0.002), "") << "package " << answer.package;
  }
}

TEST(ArmLoop, FollowsTheHandOnceEngagedAndBrakesBeforeItEnds) {
  ArmBench bench;
  bench.X_BE_goal.translation() += Eigen::Vector3d(0.05, 0.04, -0.03);
  safety::ModeState engaged;
  bench.arm.script = engaged_script(bench, [&](int n) {
    if (n == 200) engaged = bench.mode();
    if (n == 250) bench.shut_down();  // in full motion
    return IoStatus::kDone;
  });
  EXPECT_EQ(bench.run(), 0U) << "heap uses";
  EXPECT_EQ(engaged.mode, Mode::kEngaged);
  EXPECT_TRUE(engaged.request_accepted);
  const auto& answers = bench.arm.answers;
  ASSERT_GT(answers.size(), 250U);
  EXPECT_EQ(answers[8].command.action, ArmAction::kHold);
  EXPECT_EQ(answers[9].command.action, ArmAction::kTrack) << "the request is decided in the same tick";
  EXPECT_GT(answers[248].command.qd_rad_s.norm(), 0.05) << "it was moving";
  EXPECT_EQ(answers.back().command.action, ArmAction::kHold);
  EXPECT_EQ(answers.back().command.qd_rad_s.norm(), 0.0);
  EXPECT_EQ(bench.mode().mode, Mode::kStopped);
  EXPECT_EQ(bench.mode().cause, Cause::kShutdown);
  EXPECT_TRUE(bench.edges.arm_finished);
  expect_limits(bench);
}

TEST(ArmLoop, ReachesTheHandAndStampsCommandsWithTheirMeasurement) {
  ArmBench bench;
  bench.X_BE_goal.translation() += Eigen::Vector3d(0.05, 0.04, -0.03);
  bench.arm.script = engaged_script(bench, [&](int n) {
    if (n == 4000) bench.shut_down();
    return IoStatus::kDone;
  });
  bench.run();
  const FakeArm::Answer& answer = bench.arm.answers[3998];
  EXPECT_LT(test::distance(robot::forward_kinematics(answer.command.q_rad), bench.X_BE_goal), 1e-5);
  EXPECT_GT(answer.command.t_capture, TimePoint{});
  EXPECT_LE(answer.command.t_capture, answer.t_arrival + milliseconds(1));
  ArmTiming timing;
  ASSERT_TRUE(bench.edges.arm_timings.pop(timing));
  EXPECT_LE(timing.t_tick, timing.t_computed);
  EXPECT_LE(timing.t_computed, timing.t_written);
  expect_limits(bench);
}

TEST(ArmLoop, SetsTheClutchWhenItEngages) {
  ArmBench bench(patient(), patient_modes(), teleop::Clutch::kRelative);
  bench.X_BE_goal.translation() += Eigen::Vector3d(0.2, 0.3, -0.1);  // the hand rests elsewhere
  bench.arm.script = engaged_script(bench, [&](int n) {
    if (n == 1000) bench.shut_down();
    return IoStatus::kDone;
  });
  bench.run();
  EXPECT_EQ(bench.arm.answers[900].command.action, ArmAction::kTrack);
  EXPECT_LT((bench.arm.answers[900].command.q_rad - test::usual_posture()).norm(), 1e-9);
}

TEST(ArmLoop, FollowsNoPoseThatIsNotValid) {
  ArmBench bench;
  int n = 0;
  bench.arm.script = [&] {
    if (++n == 100) bench.X_BE_goal.translation().z() -= 0.1;
    bench.valid = n < 100;
    bench.publish_pose();
    if (n == 10) bench.ask(RequestKind::kEngage);
    if (n == 1000) bench.shut_down();
    return IoStatus::kDone;
  };
  bench.run();
  EXPECT_EQ(bench.arm.answers[900].command.action, ArmAction::kTrack);
  EXPECT_LT((bench.arm.answers[900].command.q_rad - test::usual_posture()).norm(), 1e-9);
  EXPECT_LT(bench.arm.answers[900].command.t_capture, bench.arm.answers[100].t_arrival) << "the newest valid pose";
}

TEST(ArmLoop, WaitsForTheRobotsProgramToFollowAndHoldsWhenItNeverDoes) {
  ArmLoopConfig config = patient();
  config.arming_grace = milliseconds(20);
  ArmBench bench(config);
  bench.arm.obedient = false;
  bench.X_BE_goal.translation().z() -= 0.05;
  bench.arm.script = engaged_script(bench, [&](int) {
    if (bench.mode().mode == Mode::kHolding) bench.shut_down();
    return IoStatus::kDone;
  });
  bench.run();
  EXPECT_EQ(bench.mode().holds, 1U);
  for (const FakeArm::Answer& answer : bench.arm.answers) {
    ASSERT_LT((answer.command.q_rad - test::usual_posture()).norm(), 1e-12) << "moves although nobody follows";
  }
}

TEST(ArmLoop, HoldsWhenTheHandPoseStaysAway) {
  ArmBench bench(patient(), safety::ModeConfig{});
  bench.X_BE_goal.translation().z() -= 0.10;
  bool coasted = false;
  int n = 0;
  bench.arm.script = [&] {
    if (++n <= 100) bench.publish_pose();  // and then the tracker is silent
    if (n == 10) bench.ask(RequestKind::kEngage);
    const Mode mode = bench.mode().mode;
    coasted = coasted || mode == Mode::kCoasting;
    if (mode == Mode::kHolding) bench.shut_down();
    return IoStatus::kDone;
  };
  bench.run();
  EXPECT_TRUE(coasted);
  EXPECT_EQ(bench.mode().holds, 1U);
  EXPECT_EQ(bench.arm.answers.back().command.action, ArmAction::kHold);
}

TEST(ArmLoop, EndsMotionWhenTheHandPoseJumpsAndEngagesAgainOnRequestOnly) {
  ArmBench bench;
  bench.jumps = 7;  // those before engaging do not count
  std::vector<safety::ModeState> seen(2000);
  bench.arm.script = engaged_script(bench, [&](int n) {
    if (n == 100) ++bench.jumps;
    if (n == 1000) bench.ask(RequestKind::kEngage);
    if (n == 1200) bench.shut_down();
    seen[static_cast<std::size_t>(std::min(n, 1999))] = bench.mode();
    return IoStatus::kDone;
  });
  EXPECT_EQ(bench.run(), 0U) << "heap uses";
  EXPECT_EQ(seen[100].mode, Mode::kEngaged);
  // The pose with the jump was published just before package 100 was read: at the latest two ticks later it counts.
  EXPECT_EQ(seen[103].mode, Mode::kHolding);
  EXPECT_EQ(seen[103].cause, Cause::kHandPoseJumped);
  EXPECT_EQ(seen[1000].mode, Mode::kHolding);
  EXPECT_EQ(seen[1100].mode, Mode::kEngaged);
  EXPECT_EQ(seen[1100].holds, 1U);
}

TEST(ArmLoop, DisarmsInTheTickOfAProtectiveStop) {
  ArmBench bench;
  bench.X_BE_goal.translation().z() -= 0.05;
  bench.arm.script = engaged_script(bench, [&](int n) {
    if (n == 100) bench.arm.state.condition = ArmCondition::kProtectiveStop;
    if (n == 200) bench.shut_down();
    return IoStatus::kDone;
  });
  bench.run();
  EXPECT_EQ(bench.arm.answers[98].command.action, ArmAction::kTrack);
  for (std::size_t i = 99; i < bench.arm.answers.size(); ++i) {
    ASSERT_EQ(bench.arm.answers[i].command.action, ArmAction::kHold) << i;
  }
}

}  // namespace
}  // namespace embody
