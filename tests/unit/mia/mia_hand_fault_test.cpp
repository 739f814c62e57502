// Stopping, and what a Mia hand's driver does when the line or the hand misbehaves.
#include <gtest/gtest.h>
#include <poll.h>

#include <cmath>

#include "tests/unit/mia/rig.hpp"

namespace embody::test {
namespace {

TEST(MiaHand, StopStandsWithinATenthOfASecondAndStaysUntilHoldAndMove) {
  MiaRig rig;
  const HandCommand far = MiaRig::move(1.1, 1.3, 1.3, std::chrono::seconds(60));
  ASSERT_TRUE(rig.cycle(far));
  ASSERT_TRUE(rig.turn_until([&] { return rig.simulator.motor_counts()[2] > 30.0; }));
  const TimePoint stopped = transport::now();
  ASSERT_EQ(rig.hand->write(MiaRig::plain(HandAction::kStop), stopped), IoStatus::kDone);
  EXPECT_TRUE(rig.hand->stopped());
  EXPECT_EQ(rig.hand->write(far, transport::now()), IoStatus::kRefused) << "latched at once";
  ASSERT_TRUE(rig.turn_until([&] { return transport::now() > stopped + milliseconds(300); }));
  const auto log = rig.simulator.log();
  for (const sim::MiaSample& sample : log) {
    if (sample.t < stopped + milliseconds(100)) continue;
    for (std::size_t i = 0; i < mia::kMotors; ++i) ASSERT_EQ(sample.q_rad[i], log.back().q_rad[i]);
  }
  EXPECT_LT(log.back().q_rad[2], 0.9) << "stopped on the way";
  EXPECT_EQ(rig.simulator.counters().stops, 1u);

  EXPECT_EQ(rig.hand->write(far, transport::now()), IoStatus::kRefused) << "still latched";
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  EXPECT_TRUE(rig.hand->stopped()) << "holding alone opens nothing";
  ASSERT_TRUE(rig.cycle(far));
  EXPECT_FALSE(rig.hand->stopped());
  ASSERT_TRUE(rig.turn_until([&] { return rig.simulator.joint_angles_rad()[2] > 1.25; })) << "moves again";

  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kStop)));
  EXPECT_EQ(rig.simulator.counters().stops, 2u) << "a second stop is sent like the first";
}

TEST(MiaHand, MotionUnderWayWhenTheStopCameIsSentAgainAfterwards) {
  sim::MiaSimulatorConfig simulated;
  simulated.ack_delay = milliseconds(20);
  MiaRig rig(patient_config(), simulated);
  const HandCommand move = MiaRig::move(0.5, 0.5, 0.5, std::chrono::seconds(60));
  ASSERT_EQ(rig.hand->write(move, transport::now()), IoStatus::kDone);
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kStop)));
  EXPECT_EQ(rig.simulator.counters().motions, 1u) << "the thumb was told, the rest dropped";
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  ASSERT_TRUE(rig.cycle(move));
  EXPECT_EQ(rig.simulator.counters().motions, 4u) << "all three, the thumb too";
}

TEST(MiaHand, StopIsSentFourTimesAndThenAsZeroSpeedBeforeTheSessionIsGivenUp) {
  MiaRig rig(quick_config());
  ASSERT_TRUE(rig.cycle(MiaRig::move(1.1, 1.3, 1.3)));
  rig.simulator.mute(true);
  const std::uint64_t before = rig.simulator.counters().commands;
  ASSERT_EQ(rig.hand->write(MiaRig::plain(HandAction::kStop), transport::now()), IoStatus::kDone);
  ASSERT_TRUE(rig.turn_until([&] { return rig.turn() == IoStatus::kDisconnected; }));
  EXPECT_EQ(rig.simulator.counters().stops, 4u);
  EXPECT_EQ(rig.simulator.counters().commands - before, 7u) << "four stops, three zero speeds";
}

TEST(MiaHand, LostAckIsCountedAndTheCommandSentOnceMoreInTheSameCycle) {
  MiaRig rig(quick_config());
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  const mia::MiaCounters before = rig.hand->counters();
  const std::uint64_t motions = rig.simulator.counters().motions;
  ASSERT_TRUE(rig.simulator.fault("drop_ack 1").ok());
  ASSERT_TRUE(rig.cycle(MiaRig::move(0.0, 0.0, 0.8)));
  EXPECT_GE(rig.hand->counters().timeouts, before.timeouts + 1);
  EXPECT_GE(rig.hand->counters().retries, before.retries + 1);
  EXPECT_GE(rig.simulator.counters().motions, motions + 4) << "three motors, one of them twice";
  const std::uint64_t told = rig.simulator.counters().motions;
  ASSERT_TRUE(rig.cycle(MiaRig::move(0.0, 0.0, 0.8)));
  EXPECT_EQ(rig.simulator.counters().motions, told) << "all have heard it";
}

TEST(MiaHand, TargetWhoseAckWasLostIsTakenBackByTheNextOne) {
  MiaRig rig(quick_config());
  const double open = std::round(mia::motor_counts({}, {0.1, 0.0, 0.0})[0]);
  ASSERT_TRUE(rig.arrives(MiaRig::move(0.1, 0.0, 0.0), 0, open));
  rig.simulator.drop_next(1);
  ASSERT_TRUE(rig.cycle(MiaRig::move(1.0, 0.0, 0.0)));  // obeyed, but not acknowledged
  ASSERT_TRUE(rig.cycle(MiaRig::move(0.1, 0.0, 0.0)));
  ASSERT_TRUE(rig.turn_until([&] { return std::abs(rig.simulator.motor_counts()[0] - open) < 0.5; }));
}

TEST(MiaHand, GarbledLinesAreCountedAndSurvived) {
  MiaRig rig(quick_config());
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  const mia::MiaCounters before = rig.hand->counters();
  for (int i = 0; i < 4; ++i) {
    rig.simulator.garble_next(1);
    ASSERT_EQ(rig.hand->write(MiaRig::plain(HandAction::kHold), transport::now()), IoStatus::kDone);
    ASSERT_TRUE(rig.turn_until([&, i] { return rig.hand->counters().timeouts > before.timeouts + i; }));
    ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  }
  EXPECT_GE(rig.hand->counters().mismatches, before.mismatches + 4);
}

TEST(MiaHand, SilenceEndsTheSessionAndConnectOpensANewOne) {
  MiaRig rig(quick_config());
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  rig.simulator.mute(true);
  const std::uint64_t before = rig.hand->counters().timeouts;
  IoStatus status = IoStatus::kDone;
  ASSERT_TRUE(rig.turn_until([&] {
    status = rig.hand->write(MiaRig::plain(HandAction::kHold), transport::now());
    return status == IoStatus::kDisconnected;
  }));
  EXPECT_EQ(rig.hand->counters().timeouts, before + 5);
  EXPECT_EQ(rig.turn(), IoStatus::kDisconnected) << "and stays so";
  rig.simulator.mute(false);
  const auto again = rig.hand->connect();
  ASSERT_TRUE(again.ok()) << again.error().detail.view();
  rig.info = *again;
  EXPECT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
}

TEST(MiaHand, UnpluggedCableEndsTheSessionAndPluggingInThroughTheLinkHelps) {
  const std::string link = ::testing::TempDir() + "embody_mia_link_" + std::to_string(::getpid());
  sim::MiaSimulatorConfig simulated;
  simulated.link = link;
  sim::MiaSimulator simulator(simulated);
  ASSERT_TRUE(simulator.start().ok());
  mia::MiaConfig config = patient_config();
  config.device = link;
  mia::MiaHand hand(config);
  const auto info = hand.connect();
  ASSERT_TRUE(info.ok()) << info.error().detail.view();
  simulator.unplug();
  EXPECT_NE(::access(link.c_str(), F_OK), 0) << "the device node is gone";
  pollfd entry{info->fd, POLLIN, 0};
  EXPECT_EQ(::poll(&entry, 1, 0), 1) << "the loop is woken at once";
  HandDeviceState state;
  EXPECT_EQ(hand.read(state), IoStatus::kDisconnected);
  EXPECT_EQ(hand.write(MiaRig::plain(HandAction::kStop), transport::now()), IoStatus::kDisconnected);
  const auto missing = hand.connect();
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, Errc::kNotFound);
  ASSERT_TRUE(simulator.start().ok());
  EXPECT_TRUE(hand.connect().ok());
}

TEST(MiaHand, DestructorStopsTheMotors) {
  MiaRig rig;
  ASSERT_TRUE(rig.cycle(MiaRig::move(1.1, 1.3, 1.3)));
  ASSERT_TRUE(rig.turn_until([&] { return rig.simulator.motor_counts()[2] > 20.0; }));
  rig.hand.reset();
  EXPECT_EQ(rig.simulator.counters().stops, 1u);
  const auto counts = rig.simulator.motor_counts();
  EXPECT_LT(counts[2], 150.0);
  const TimePoint later = transport::now() + milliseconds(100);
  while (transport::now() < later) {
  }
  EXPECT_EQ(rig.simulator.motor_counts(), counts);
}

TEST(MiaHand, DestructorDoesNotHangOnASilentHand) {
  MiaRig rig(quick_config());
  rig.simulator.mute(true);
  const TimePoint start = transport::now();
  rig.hand.reset();
  EXPECT_LT(transport::now() - start, milliseconds(600));
  EXPECT_EQ(rig.simulator.counters().stops, 4u);
}

TEST(MiaHand, SilenceIsNoticedByWritingAloneToo) {
  MiaRig rig(quick_config());
  rig.simulator.mute(true);
  IoStatus status = IoStatus::kDone;
  const TimePoint start = transport::now();
  while (status == IoStatus::kDone && transport::now() < start + std::chrono::seconds(5)) {
    status = rig.hand->write(MiaRig::plain(HandAction::kHold), transport::now());
    static_cast<void>(transport::wait_readable(rig.info.fd, transport::now() + milliseconds(5)));
  }
  EXPECT_EQ(status, IoStatus::kDisconnected);
}

}  // namespace
}  // namespace embody::test
