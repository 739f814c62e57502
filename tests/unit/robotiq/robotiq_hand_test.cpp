#include "drivers/robotiq/robotiq_hand.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "drivers/transport/pty.hpp"
#include "tests/support/heap_counter.hpp"
#include "tests/unit/robotiq/rig.hpp"

namespace embody::test {
namespace {

TEST(RobotiqHand, NothingMovesAndNothingIsWrittenOnConnectAndHold) {
  RobotiqRig rig;
  EXPECT_EQ(rig.info.joint_count, 1u);
  EXPECT_EQ(rig.info.joint_names[0].view(), "finger_joint");
  EXPECT_NE(rig.info.peer.view().find("slave 9, activated, fault 0"), std::string_view::npos) << rig.info.peer.view();
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  const auto counters = rig.simulator.counters();
  EXPECT_EQ(counters.motions + counters.stops + counters.resets + counters.activations, 0u);
  EXPECT_EQ(rig.simulator.travelled_counts(), 0.0);
  EXPECT_EQ(rig.state.joint_count, 1u);
  EXPECT_NEAR(rig.state.q_rad[0], 0.7 * 50 / 255, 1e-9);
  EXPECT_EQ(rig.state.reply, rig.hand->counters().statuses);
}

TEST(RobotiqHand, MovesToTheAngleWithBothWaysOfAsking) {
  for (const bool combined : {false, true}) {
    robotiq::RobotiqConfig config = patient_config();
    config.combined_exchange = combined;
    RobotiqRig rig(config);
    ASSERT_TRUE(rig.move_until(0.5, [&rig] {
      return rig.hand->status().object == robotiq::ObjectState::kAtRequest && rig.hand->status().position_echo > 150;
    })) << combined;
    EXPECT_NEAR(rig.state.q_rad[0], 0.5, 0.7 / 255);
    EXPECT_NEAR(rig.simulator.counts(), 255 * 0.5 / 0.7, 0.51);
    EXPECT_EQ(rig.simulator.counters().too_early, 0u) << "half duplex is kept";
  }
}

TEST(RobotiqHand, SendsATargetOnceAndAgainAfterASecond) {
  RobotiqRig rig;
  ASSERT_TRUE(rig.cycle(RobotiqRig::move(0.3)));
  ASSERT_TRUE(rig.cycle(RobotiqRig::move(0.3)));
  const TimePoint start = transport::now();
  const std::uint64_t before = rig.simulator.counters().motions;
  ASSERT_TRUE(rig.move_until(0.3, [&] { return transport::now() > start + milliseconds(300); }));
  EXPECT_EQ(rig.simulator.counters().motions, before) << "no change";
  ASSERT_TRUE(rig.cycle(RobotiqRig::move(0.31)));
  EXPECT_EQ(rig.simulator.counters().motions, before + 1) << "a change";
  ASSERT_TRUE(rig.move_until(0.31, [&] { return rig.simulator.counters().motions > before + 1; })) << "the refresh";
  EXPECT_GT(transport::now() - start, milliseconds(900));
}

TEST(RobotiqHand, TargetsBeyondTheLimitsEndAtTheLimits) {
  RobotiqRig rig;
  EXPECT_TRUE(rig.move_until(9.0, [&rig] { return rig.simulator.counts() >= 252.0 - 1e-6; }));
  EXPECT_EQ(rig.simulator.status().position_echo, 255);
  EXPECT_TRUE(rig.move_until(-9.0, [&rig] { return rig.simulator.counts() <= 3.0 + 1e-6; }));
  EXPECT_EQ(rig.simulator.status().position_echo, 0);
}

TEST(RobotiqHand, RefusesWhatHasExpiredOrIsNotFiniteOrHasTheWrongSize) {
  RobotiqRig rig;
  ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  HandCommand expired = RobotiqRig::move(0.5);
  expired.t_expires = transport::now() - milliseconds(1);
  HandCommand never_valid = RobotiqRig::move(0.5);
  never_valid.t_expires = {};
  HandCommand wrong_size = RobotiqRig::move(0.5);
  wrong_size.joint_count = 2;
  for (const HandCommand& command :
       {expired, never_valid, wrong_size, RobotiqRig::move(std::numeric_limits<double>::quiet_NaN()),
        RobotiqRig::move(std::numeric_limits<double>::infinity())}) {
    EXPECT_EQ(rig.hand->write(command, transport::now()), IoStatus::kRefused);
  }
  ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  EXPECT_EQ(rig.simulator.counters().motions, 0u);
  EXPECT_EQ(rig.simulator.travelled_counts(), 0.0);
}

TEST(RobotiqHand, QueuedMotionIsNotSentAfterItsTimeAndHoldDropsIt) {
  sim::RobotiqSimulatorConfig simulated = activated_gripper();
  simulated.gripper.reply_delay = milliseconds(40);
  RobotiqRig rig(patient_config(), simulated);
  ASSERT_EQ(rig.hand->write(RobotiqRig::plain(HandAction::kHold), transport::now()), IoStatus::kDone);
  ASSERT_EQ(rig.hand->write(RobotiqRig::move(0.5, milliseconds(10)), transport::now()), IoStatus::kDone);
  ASSERT_TRUE(rig.turn_until([&rig] { return rig.hand->counters().expired == 1; }));
  ASSERT_EQ(rig.hand->write(RobotiqRig::move(0.5), transport::now()), IoStatus::kDone);
  ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  EXPECT_EQ(rig.simulator.counters().motions, 0u);
}

TEST(RobotiqHand, ReportsAnObjectBetweenTheFingers) {
  RobotiqRig rig;
  rig.inject("object 60");
  ASSERT_TRUE(
      rig.move_until(0.7, [&rig] { return rig.hand->status().object == robotiq::ObjectState::kStoppedClosing; }));
  EXPECT_NEAR(rig.simulator.counts(), 255 * (1.0 - 60.0 / 140.0), 1e-6);
  EXPECT_LT(rig.state.q_rad[0], 0.5);
}

TEST(RobotiqHand, ReadAndWriteDoNotTouchTheHeap) {
  if (!counts_heap()) GTEST_SKIP() << "sanitizers own malloc";
  RobotiqRig rig(quick_config());
  const std::uint64_t control = heap_allocations();
  { const std::string proof(100, 'x'); }
  ASSERT_GT(heap_allocations(), control) << "the counter counts";
  std::uint64_t used = 0;
  rig.inject("crc 1");
  for (int i = 0; i < 300; ++i) {
    if (i == 50) rig.inject("exception 1");
    if (i == 100) rig.inject("fault 14");
    if (i == 120) rig.hand->request_activation();
    HandCommand command = RobotiqRig::move(0.02 * (i % 30));
    if (i % 70 > 60) command.action = HandAction::kHold;
    if (i == 200) command.action = HandAction::kStop;
    const std::uint64_t before = heap_allocations();
    const IoStatus written = rig.hand->write(command, transport::now());
    const IoStatus status = rig.hand->read(rig.state);
    static_cast<void>(rig.hand->why_not());
    used += heap_allocations() - before;
    ASSERT_NE(written, IoStatus::kDisconnected);
    if (status == IoStatus::kDone) ++rig.replies;
    static_cast<void>(transport::wait_readable(rig.info.fd, transport::now() + milliseconds(5)));
  }
  EXPECT_GT(rig.replies, 20u);
  EXPECT_EQ(used, 0u);
}

TEST(RobotiqHand, ConnectSaysWhenNobodyAnswers) {
  const auto pty = transport::open_pty();
  ASSERT_TRUE(pty.ok());
  robotiq::RobotiqConfig config;
  config.device = pty->device;
  robotiq::RobotiqHand hand(config);
  const TimePoint start = transport::now();
  const auto info = hand.connect();
  ASSERT_FALSE(info.ok());
  EXPECT_EQ(info.error().code, Errc::kTimeout);
  EXPECT_LT(transport::now() - start, milliseconds(2500));
  HandDeviceState state;
  EXPECT_EQ(hand.read(state), IoStatus::kDisconnected);
  EXPECT_EQ(hand.write(RobotiqRig::move(0.1), transport::now()), IoStatus::kDisconnected);
  EXPECT_FALSE(hand.why_not().empty());
  EXPECT_EQ(hand.activate().error().code, Errc::kDisconnected);
}

TEST(RobotiqHand, ConnectFailsForTheWrongSlaveOrDevice) {
  sim::RobotiqSimulatorConfig simulated = activated_gripper();
  sim::RobotiqSimulator simulator(simulated);
  ASSERT_TRUE(simulator.start().ok());
  robotiq::RobotiqConfig config;
  config.device = simulator.device();
  config.slave = 8;
  EXPECT_EQ(robotiq::RobotiqHand(config).connect().error().code, Errc::kTimeout);
  config.device = "/dev/null";
  EXPECT_EQ(robotiq::RobotiqHand(config).connect().error().code, Errc::kInvalidArgument);
  config.device = "/dev/no_such_line";
  EXPECT_EQ(robotiq::RobotiqHand(config).connect().error().code, Errc::kNotFound);
}

TEST(RobotiqHand, ConnectSaysWhenTheSlaveIsNoGripper) {
  sim::RobotiqSimulator simulator(activated_gripper());
  ASSERT_TRUE(simulator.start().ok());
  ASSERT_TRUE(simulator.fault("exception 1000").ok());
  robotiq::RobotiqConfig config;
  config.device = simulator.device();
  const auto info = robotiq::RobotiqHand(config).connect();
  ASSERT_FALSE(info.ok());
  EXPECT_EQ(info.error().code, Errc::kUnsupported);
}

TEST(RobotiqHand, ConnectRefusesAnUnusableConfiguration) {
  const auto refused = [](auto change) {
    robotiq::RobotiqConfig config;
    change(config);
    const auto info = robotiq::RobotiqHand(config).connect();
    return !info.ok() && info.error().code == Errc::kInvalidArgument;
  };
  EXPECT_TRUE(refused([](robotiq::RobotiqConfig& c) { c.slave = 0; }));
  EXPECT_TRUE(refused([](robotiq::RobotiqConfig& c) { c.slave = 248; }));
  EXPECT_TRUE(refused([](robotiq::RobotiqConfig& c) { c.speed = 256; }));
  EXPECT_TRUE(refused([](robotiq::RobotiqConfig& c) { c.force = -1; }));
  EXPECT_TRUE(refused([](robotiq::RobotiqConfig& c) { c.joint.clear(); }));
  EXPECT_TRUE(refused([](robotiq::RobotiqConfig& c) { c.scale.closed_counts = 0; }));
  EXPECT_TRUE(refused([](robotiq::RobotiqConfig& c) { c.scale.closed_counts = 256; }));
  EXPECT_TRUE(refused([](robotiq::RobotiqConfig& c) { c.scale.closed_rad = std::nan(""); }));
  EXPECT_TRUE(refused([](robotiq::RobotiqConfig& c) { c.rate_hz = 0.0; }));
  EXPECT_TRUE(refused([](robotiq::RobotiqConfig& c) { c.reply_timeout = Duration::zero(); }));
  EXPECT_TRUE(refused([](robotiq::RobotiqConfig& c) { c.lost_after_failures = 0; }));
}

}  // namespace
}  // namespace embody::test
