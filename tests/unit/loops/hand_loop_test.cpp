#include "daemon/loops/hand_loop.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/loops/fakes.hpp"

namespace embody {
namespace {

using safety::Mode;
using std::chrono::seconds;
using transport::now;

constexpr Duration kPeriod = std::chrono::milliseconds(2);

/// A hand loop over a fake hand that answers in every cycle. Time-outs are long, so that a busy machine changes
/// nothing.
class HandBench {
 public:
  HandBench() : baton(hand), loop(baton, gate(), {kPeriod}, edges) {
    hand.fd = ready.get();
    commands.reserve(1000);
    hand.on_read = [this](HandDeviceState& state) {
      if (replies == cycles) return IoStatus::kEmpty;
      state.reply = replies = cycles;
      state.t_arrival = now();
      state.joint_count = 3;
      state.q_rad = q_rad;
      return IoStatus::kDone;
    };
    hand.on_write = [this](const HandCommand& command, TimePoint t) {
      if (t > command.t_expires) ++expired;
      if (commands.size() < commands.capacity()) commands.push_back(command);
      if (command.action == HandAction::kMove) q_rad = command.q_rad;
      ++cycles;
      script(cycles);
      return IoStatus::kDone;
    };
  }
  static safety::HandGateConfig gate() {
    safety::HandGateConfig config;
    config.mode_timeout = seconds(10);
    config.target_timeout = seconds(10);
    return config;
  }
  void publish(Mode mode, TimePoint t) {
    safety::ModeState state;
    state.mode = mode;
    state.t = t;
    edges.mode_to_hand.publish(state);
  }
  void publish_target(double q) {
    FingerTarget target;
    target.valid = true;
    target.t_capture = now();
    target.joint_count = 3;
    target.q_rad.fill(q);
    edges.target_to_hand.publish(target);
  }
  std::uint64_t run() {
    baton.pass_to_loop(*hand.connect());
    test::WatchedThread thread(edges.stop, [this] { loop.run(); });
    return thread.join();
  }

  test::EventFd ready{true};
  test::FakeHand hand;
  Edges edges;
  HandBaton baton;
  HandLoop loop;
  std::uint64_t cycles{1};  // the first reply comes before the first command
  std::uint64_t replies{0};
  std::uint64_t expired{0};
  std::array<double, kMaxHandJoints> q_rad{};
  std::vector<HandCommand> commands;
  std::function<void(std::uint64_t)> script{[](std::uint64_t) {}};
};

TEST(HandLoop, MovesTheFingersTowardsTheirTargetAtLimitedSpeedAndStopsTheMotorsAtTheEnd) {
  HandBench bench;
  bench.q_rad.fill(0.3);
  bench.publish(Mode::kEngaged, now());
  bench.publish_target(0.5);
  bench.script = [&](std::uint64_t n) {
    if (n == 100) bench.edges.stop = true;
  };
  EXPECT_EQ(bench.run(), 0U) << "heap uses";
  ASSERT_GT(bench.commands.size(), 60U);
  double last = 0.3;
  for (std::size_t i = 0; i + 1 < bench.commands.size(); ++i) {
    const HandCommand& command = bench.commands[i];
    ASSERT_EQ(command.sequence, i + 1);
    ASSERT_EQ(command.action, HandAction::kMove);
    ASSERT_LE(std::abs(command.q_rad[0] - last), HandBench::gate().speed_rad_s * to_seconds(kPeriod) + 1e-12);
    last = command.q_rad[0];
  }
  EXPECT_NEAR(last, 0.5, 1e-9);
  EXPECT_EQ(bench.commands.back().action, HandAction::kStop);
  EXPECT_EQ(bench.commands.back().joint_count, 3U);
  EXPECT_TRUE(bench.edges.hand_ready);
}

TEST(HandLoop, RefusesAnOldModeAndAnyModeButEngaged) {
  HandBench bench;
  bench.publish_target(0.5);
  // By cycle: which mode, how old, and what must come of it.
  const struct {
    Mode mode;
    Duration age;
    HandAction expected;
  } kSteps[] = {
      {Mode::kEngaged, seconds(0), HandAction::kMove},  {Mode::kEngaged, seconds(20), HandAction::kHold},
      {Mode::kEngaged, seconds(0), HandAction::kMove},  {Mode::kCoasting, seconds(0), HandAction::kHold},
      {Mode::kHolding, seconds(0), HandAction::kHold},  {Mode::kStopped, seconds(0), HandAction::kStop},
      {Mode::kStopped, seconds(20), HandAction::kHold}, {Mode::kIdle, seconds(0), HandAction::kHold},
  };
  constexpr std::size_t kCount = std::size(kSteps);
  bench.publish(kSteps[0].mode, now() - kSteps[0].age);
  bench.script = [&](std::uint64_t) {
    const std::size_t next = bench.commands.size();
    if (next >= kCount) {
      bench.edges.stop = true;
    } else {
      bench.publish(kSteps[next].mode, now() - kSteps[next].age);
    }
  };
  bench.run();
  ASSERT_GE(bench.commands.size(), kCount);
  for (std::size_t i = 0; i < kCount; ++i) EXPECT_EQ(bench.commands[i].action, kSteps[i].expected) << "step " << i;
}

TEST(HandLoop, HoldsBeforeAnyModeIsKnown) {
  HandBench bench;
  bench.publish_target(0.5);
  bench.script = [&](std::uint64_t n) {
    if (n == 20) bench.edges.stop = true;
  };
  bench.run();
  ASSERT_GT(bench.commands.size(), 5U);
  for (std::size_t i = 0; i + 1 < bench.commands.size(); ++i) {
    ASSERT_EQ(bench.commands[i].action, HandAction::kHold);
    ASSERT_EQ(bench.commands[i].joint_count, 3U);
  }
}

TEST(HandLoop, ReportsWhyTheHandHolds) {
  HandBench bench;
  bench.publish(Mode::kAligned, now());
  bench.publish_target(0.5);
  bench.script = [&](std::uint64_t n) {
    if (n == 20) bench.edges.stop = true;
  };
  bench.run();
  ASSERT_TRUE(bench.edges.hand_to_telemetry.update());
  EXPECT_EQ(bench.edges.hand_to_telemetry.get().hold, safety::HandHold::kMode);
}

TEST(HandLoop, GivesALostHandBackAndSaysThatItIsNotReady) {
  for (const bool on_write : {false, true}) {
    HandBench bench;
    const auto answer = bench.hand.on_read;
    int reads = 0;
    bench.hand.on_read = [&](HandDeviceState& state) {
      if (!on_write && ++reads > 50) {
        bench.edges.stop = true;
        return IoStatus::kDisconnected;
      }
      return answer(state);
    };
    int writes = 0;
    bench.hand.on_write = [&](const HandCommand&, TimePoint) {
      ++bench.cycles;
      if (!on_write || ++writes < 10) return IoStatus::kDone;
      bench.edges.stop = true;
      return IoStatus::kDisconnected;
    };
    bench.run();
    EXPECT_TRUE(bench.baton.with_links());
    EXPECT_FALSE(bench.edges.hand_ready);
    EXPECT_GT(bench.edges.counters.hand_replies, 0U);
  }
}

TEST(HandLoop, IsReadyOnlyWhenTheHandHasAnswered) {
  HandBench bench;
  bench.hand.on_read = [](HandDeviceState&) { return IoStatus::kEmpty; };
  bench.script = [&](std::uint64_t n) {
    if (n == 20) bench.edges.stop = true;
  };
  bench.run();
  EXPECT_FALSE(bench.edges.hand_ready);
  EXPECT_EQ(bench.edges.counters.hand_commands, 0U);
  for (const HandCommand& command : bench.commands) ASSERT_EQ(command.joint_count, 3U) << "the bus needs a cycle";
}

TEST(HandLoop, BeatsWithoutAHand) {
  HandBench bench;
  test::WatchedThread thread(bench.edges.stop, [&] { bench.loop.run(); });
  EXPECT_TRUE(test::eventually([&] { return bench.edges.heartbeats.hand > 5; }));
  bench.edges.stop = true;
  EXPECT_EQ(thread.join(), 0U) << "heap uses";
}

}  // namespace
}  // namespace embody
