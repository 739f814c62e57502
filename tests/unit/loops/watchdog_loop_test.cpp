#include "daemon/loops/watchdog_loop.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <array>

#include "tests/unit/loops/fakes.hpp"

namespace embody {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using transport::now;

enum class Hung { kNobody, kArm, kTracker, kHand };

struct Outcome {
  bool latched{false};
  bool socket_shut{false};
  Duration until_latched{0};
  Duration longest_pause{0};  ///< of the beats that this test made: a busy machine pauses it
  std::uint64_t heap_uses{0};
};

/// Runs the watchdog while this thread beats for every loop but `hung`, until it latches or `duration` is over.
Outcome watch(Hung hung, Duration duration) {
  std::array<int, 2> ends{};
  EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends.data()), 0);
  const transport::UniqueFd ours(ends[0]);
  const transport::UniqueFd robot(ends[1]);
  test::FakeArm arm;
  arm.fd = ours.get();
  ArmBaton baton(arm);
  baton.pass_to_loop(*arm.connect());
  Edges edges;
  WatchdogLoop loop(baton, edges);
  Outcome outcome;
  const auto robot_sees_the_end = [&] {
    char byte = 0;
    return ::recv(robot.get(), &byte, 1, 0) == 0;
  };
  const TimePoint start = now();
  test::WatchedThread thread(edges.stop, [&] { loop.run(); });
  TimePoint last = start;
  while (now() - start < duration) {
    if (hung != Hung::kArm) ++edges.heartbeats.arm;
    if (hung != Hung::kTracker) ++edges.heartbeats.tracker;
    if (hung != Hung::kHand) ++edges.heartbeats.hand;
    const TimePoint t = now();
    outcome.longest_pause = std::max(outcome.longest_pause, t - last);
    last = t;
    if (edges.watchdog_bit && !outcome.latched) {
      outcome.latched = true;
      outcome.until_latched = t - start;
    }
    if (outcome.latched && (hung != Hung::kArm || robot_sees_the_end())) break;
    std::this_thread::yield();
  }
  edges.stop = true;
  edges.arm_finished = true;
  outcome.heap_uses = thread.join();
  outcome.socket_shut = robot_sees_the_end();
  return outcome;
}

constexpr Duration kBusy = milliseconds(200);

TEST(WatchdogLoop, ShutsTheRobotsSocketWhenTheArmLoopHangs) {
  const Outcome outcome = watch(Hung::kArm, seconds(10));
  EXPECT_TRUE(outcome.latched);
  EXPECT_TRUE(outcome.socket_shut);
  EXPECT_GE(outcome.until_latched, milliseconds(400)) << "patience ended too early";
  EXPECT_EQ(outcome.heap_uses, 0U);
}

TEST(WatchdogLoop, LatchesForTheOtherLoopsToo) {
  for (const Hung hung : {Hung::kTracker, Hung::kHand}) {
    const Outcome outcome = watch(hung, seconds(10));
    if (outcome.longest_pause > kBusy) GTEST_SKIP() << "this machine is too busy to keep the other loops beating";
    EXPECT_TRUE(outcome.latched);
    EXPECT_FALSE(outcome.socket_shut) << "the arm loop works and brakes by itself";
    EXPECT_GE(outcome.until_latched, milliseconds(400));
  }
}

TEST(WatchdogLoop, LeavesLoopsAloneThatBeat) {
  const Outcome outcome = watch(Hung::kNobody, milliseconds(700));
  if (outcome.longest_pause > kBusy) GTEST_SKIP() << "this machine is too busy to keep the loops beating";
  EXPECT_FALSE(outcome.latched);
  EXPECT_FALSE(outcome.socket_shut);
}

}  // namespace
}  // namespace embody
