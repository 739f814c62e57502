// What the arm loop does when the session with the arm ends, and without one.
#include <gtest/gtest.h>

#include "tests/unit/loops/arm_bench.hpp"

namespace embody {
namespace {

using safety::Cause;
using safety::Mode;
using safety::RequestKind;
using std::chrono::milliseconds;
using test::ArmBench;
using test::engaged_script;
using test::eventually;
using test::FakeArm;

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

TEST(ArmLoop, GivesBackAnArmThatNeverSendsAPackage) {
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

TEST(ArmLoop, CommandsNothingInANewSessionBeforeTheOperatorEngages) {
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
