#include "daemon/loops/arm_loop.hpp"

#include <gtest/gtest.h>

#include "tests/unit/loops/fakes.hpp"
#include "tests/unit/teleop/arm_rig.hpp"

namespace embody {
namespace {

using safety::Cause;
using safety::Mode;
using safety::RequestKind;
using std::chrono::milliseconds;
using test::eventually;
using test::FakeArm;
using transport::now;

/// Times so long that a busy machine changes nothing.
ArmLoopConfig patient() {
  ArmLoopConfig config;
  config.command_lifetime = std::chrono::seconds(10);
  config.arming_grace = std::chrono::seconds(10);
  return config;
}
safety::ModeConfig patient_modes() {
  safety::ModeConfig config;
  config.hold_after = std::chrono::seconds(10);
  config.stop_after = std::chrono::seconds(20);
  return config;
}

/// An arm loop with a fake arm, a tracker that is there, and a hand that has answered. Scripts run on the loop's
/// thread, once for each read() of the arm.
class ArmBench {
 public:
  explicit ArmBench(const ArmLoopConfig& config = patient(), const safety::ModeConfig& modes = patient_modes())
      : tracker_baton(tracker),
        arm_baton(arm),
        cell(test::cell_config(teleop::Clutch::kAbsolute)),
        loop(arm_baton, tracker_baton, cell, modes, config, edges) {
    tracker.fd = arm.fd = ready.get();
    tracker_baton.pass_to_loop(*tracker.connect());
    arm.state.condition = ArmCondition::kReady;
    arm.state.controller_time = std::chrono::seconds(3);
    arm.state.q_rad = test::usual_posture();
    edges.hand_ready = true;
    X_BE_goal = robot::forward_kinematics(test::usual_posture());
  }
  /// From the goal of the flange to the pose of the hand that means it, captured now.
  void publish_pose() {
    HandPose pose;
    pose.valid = true;
    pose.streak = 100;
    pose.jumps = jumps;
    pose.sequence = ++poses;
    pose.t_capture = pose.t_arrival = now();
    pose.X_WM = cell.X_BW.inverse() * X_BE_goal * cell.X_EP * cell.X_PM;
    edges.pose_to_arm.publish(pose);
  }
  void ask(RequestKind kind) { edges.requests.push({kind, ++requests}); }
  /// Ends the loop the way the daemon does: it runs on until the arm stands still.
  void shut_down() {
    if (edges.stop) return;
    ask(RequestKind::kShutdown);
    edges.stop = true;
  }
  safety::ModeState mode() {
    edges.mode_to_main.update();
    return edges.mode_to_main.get();
  }
  /// Connects and runs the loop to its end on a thread of its own; returns its heap uses.
  std::uint64_t run() {
    arm_baton.pass_to_loop(*arm.connect());
    test::WatchedThread thread(edges.stop, [this] { loop.run(); });
    EXPECT_TRUE(thread.started());
    return thread.join();
  }

  test::EventFd ready{true};
  test::FakeTracker tracker;
  FakeArm arm;
  Edges edges;
  TrackerBaton tracker_baton;
  ArmBaton arm_baton;
  teleop::ArmControllerConfig cell;
  Pose X_BE_goal{Pose::Identity()};
  std::uint64_t poses{0};
  std::uint32_t jumps{0};
  std::uint32_t requests{0};
  ArmLoop loop;
};

/// A pose with every package, an engage request with the tenth, and `after(n)` decides about each later package.
template <class After>
std::function<IoStatus()> engaged_script(ArmBench& bench, After after) {
  return [&bench, after, n = 0]() mutable {
    ++n;
    bench.publish_pose();
    if (n == 10) bench.ask(RequestKind::kEngage);
    return n <= 10 ? IoStatus::kDone : after(n);
  };
}

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
  for (std::size_t i = 0; i < kPackages; ++i) {
    const FakeArm::Answer& answer = bench.arm.answers[i];
    ASSERT_EQ(answer.package, i + 1) << "answered late, twice or never";
    ASSERT_EQ(answer.command.sequence, i + 1);
    ASSERT_EQ(answer.command.action, ArmAction::kHold) << "nobody asked for motion";
    ASSERT_EQ(answer.command.t_expires, answer.t_arrival + patient().command_lifetime);
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

TEST(ArmLoop, GivesALostArmBackAndStops) {
  ArmBench bench;
  bench.arm.script = engaged_script(bench, [&](int n) {
    if (n < 100) return IoStatus::kDone;
    bench.edges.stop = true;
    return IoStatus::kDisconnected;
  });
  EXPECT_EQ(bench.run(), 0U) << "heap uses";
  EXPECT_TRUE(bench.arm_baton.with_links());
  EXPECT_EQ(bench.arm_baton.fd(), -1);
  EXPECT_EQ(bench.mode().mode, Mode::kStopped);
  EXPECT_EQ(bench.mode().cause, Cause::kArmLost);
  EXPECT_EQ(bench.mode().holds, 1U);
}

TEST(ArmLoop, GivesBackAnArmThatFallsSilent) {
  ArmBench bench;
  bench.arm.script = engaged_script(bench, [&](int n) {
    if (n < 100) return IoStatus::kDone;
    if (n > 101 && bench.mode().mode == Mode::kStopped) bench.edges.stop = true;
    return IoStatus::kEmpty;
  });
  bench.arm_baton.pass_to_loop(*bench.arm.connect());
  test::WatchedThread thread(bench.edges.stop, [&] { bench.loop.run(); });
  EXPECT_TRUE(eventually([&] { return bench.arm_baton.with_links(); }));
  bench.edges.stop = true;
  thread.join();
  EXPECT_EQ(bench.mode().mode, Mode::kStopped);
  EXPECT_EQ(bench.mode().cause, Cause::kArmLost);
}

TEST(ArmLoop, DISABLED_GivesBackAnArmThatNeverSendsAPackage) {
  ArmBench bench;
  bench.arm_baton.pass_to_loop(*bench.arm.connect());
  test::WatchedThread thread(bench.edges.stop, [&] { bench.loop.run(); });
  EXPECT_TRUE(eventually([&] { return bench.arm_baton.with_links(); })) << "links would never connect again";
  bench.edges.stop = true;
  thread.join();
}

TEST(ArmLoop, GivesTheArmBackWhenLinksRevokeIt) {
  ArmBench bench;
  bench.arm.script = engaged_script(bench, [&](int n) {
    if (n == 100) bench.arm_baton.revoke();
    return IoStatus::kDone;
  });
  bench.arm_baton.pass_to_loop(*bench.arm.connect());
  test::WatchedThread thread(bench.edges.stop, [&] { bench.loop.run(); });
  EXPECT_TRUE(eventually([&] { return bench.arm_baton.with_links(); }));
  bench.edges.stop = true;
  thread.join();
  EXPECT_EQ(bench.mode().mode, Mode::kStopped);
}

TEST(ArmLoop, DISABLED_CommandsNothingInANewSessionBeforeTheOperatorEngages) {
  ArmBench bench;
  bench.X_BE_goal.translation() += Eigen::Vector3d(0.05, 0.04, -0.20);
  int n = 0;
  bench.arm.script = [&] {
    bench.publish_pose();
    if (++n == 10) bench.ask(RequestKind::kEngage);
    if (n == 300) return IoStatus::kDisconnected;  // in full motion
    if (n == 600) bench.shut_down();
    return IoStatus::kDone;
  };
  bench.arm_baton.pass_to_loop(*bench.arm.connect());
  test::WatchedThread thread(bench.edges.stop, [&] { bench.loop.run(); });
  EXPECT_TRUE(eventually([&] { return bench.arm_baton.with_links(); }));
  bench.arm.state.q_rad += Vector6::Constant(0.05);  // where the robot braked by itself
  const Vector6 q_stopped = bench.arm.state.q_rad;
  bench.arm_baton.pass_to_loop(*bench.arm.connect());
  thread.join();
  std::size_t tracking = 0;
  for (const FakeArm::Answer& answer : bench.arm.answers) {
    if (answer.session == 2 && answer.command.action == ArmAction::kTrack) ++tracking;
  }
  EXPECT_EQ(tracking, 0U) << "tracking commands in mode stopped";
  EXPECT_LT((bench.arm.state.q_rad - q_stopped).norm(), 1e-12) << "the robot was moved";
}

TEST(ArmLoop, StillDecidesRequestsAndTicksTheModeWithoutAnArm) {
  ArmBench bench;
  test::WatchedThread thread(bench.edges.stop, [&] { bench.loop.run(); });
  bench.ask(RequestKind::kEngage);
  EXPECT_TRUE(eventually([&] { return bench.mode().request_id == 1; }));
  EXPECT_FALSE(bench.mode().request_accepted);
  EXPECT_EQ(bench.mode().mode, Mode::kOffline);
  const std::uint64_t beats = bench.edges.heartbeats.arm;
  EXPECT_TRUE(eventually([&] { return bench.edges.heartbeats.arm > beats + 10; }));
  bench.edges.stop = true;
  EXPECT_EQ(thread.join(), 0U) << "heap uses";
}

}  // namespace
}  // namespace embody
