// A hand with older firmware: commands are only sent, positions stream.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/heap_counter.hpp"
#include "tests/unit/mia/rig.hpp"

namespace embody::test {
namespace {

using std::chrono::seconds;

TEST(MiaStreaming, IsFoundByProbingAndNothingMovesOnConnect) {
  for (const bool acks : {true, false}) {
    sim::MiaSimulatorConfig simulated = sim::older_mia();
    simulated.start_counts = {100.0, -120.0, 60.0};
    simulated.acks_all = acks;
    mia::MiaConfig config = quick_config();
    if (!acks) config.generation = mia::Generation::kStreaming;  // who answers nothing has to be known
    MiaRig rig(config, simulated);
    EXPECT_EQ(rig.hand->generation(), mia::Generation::kStreaming);
    EXPECT_NE(rig.info.peer.view().find("streaming"), std::string_view::npos) << rig.info.peer.view();
    ASSERT_TRUE(rig.next_reply());
    const auto q_rad = mia::joint_angles_rad({}, simulated.start_counts);
    for (std::size_t i = 0; i < mia::kMotors; ++i) EXPECT_NEAR(rig.state.q_rad[i], q_rad[i], 1e-12);
    EXPECT_EQ(rig.simulator.counters().motions, 0u);
    EXPECT_EQ(rig.simulator.motor_counts(), simulated.start_counts);
  }
}

TEST(MiaStreaming, AForcedProtocolIsNotGuessed) {
  mia::MiaConfig config = quick_config();
  config.generation = mia::Generation::kStreaming;
  MiaRig newer_used_as_older(config);
  EXPECT_EQ(newer_used_as_older.hand->generation(), mia::Generation::kStreaming);
  EXPECT_TRUE(newer_used_as_older.next_reply());

  sim::MiaSimulator older(sim::older_mia());
  ASSERT_TRUE(older.start().ok());
  config.generation = mia::Generation::kAcknowledging;
  config.device = older.device();
  const auto refused = mia::MiaHand(config).connect();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, Errc::kUnsupported);
  config.generation.reset();
  config.space = mia::Space::kJoint;
  const auto no_angles = mia::MiaHand(config).connect();
  ASSERT_FALSE(no_angles.ok());
  EXPECT_NE(no_angles.error().detail.view().find("space"), std::string_view::npos) << no_angles.error().detail.view();
}

TEST(MiaStreaming, GoesWhereItIsSentThoughCommandsAreLostAndOneIsTakenAtATime) {
  MiaRig rig(quick_config(), sim::older_mia());
  const auto counts = mia::motor_counts({}, {0.5, -0.6, 0.7});
  ASSERT_TRUE(rig.simulator.fault("half_duplex on").ok());  // what comes before the ACK of the last one is dropped
  ASSERT_TRUE(rig.simulator.fault("deaf 4").ok());
  const TimePoint start = transport::now();
  const auto there = [&] {
    const auto now = rig.simulator.motor_counts();
    for (std::size_t i = 0; i < mia::kMotors; ++i) {
      if (std::abs(now[i] - std::round(counts[i])) > 0.5) return false;
    }
    return true;
  };
  while (!there() && transport::now() < start + seconds(5)) {
    const TimePoint next = transport::now() + milliseconds(50);
    ASSERT_EQ(rig.hand->write(MiaRig::move(0.5, -0.6, 0.7), transport::now()), IoStatus::kDone);
    while (transport::now() < next) ASSERT_NE(rig.turn(), IoStatus::kDisconnected);
  }
  EXPECT_TRUE(there());
  EXPECT_GT(rig.replies, 10u);
}

TEST(MiaStreaming, NeverHandsTheKernelMoreThanTheWireCarries) {
  MiaRig rig(quick_config(), sim::older_mia());
  const TimePoint start = transport::now();
  const std::uint64_t before = rig.hand->counters().commands;
  for (int i = 0; transport::now() < start + milliseconds(300); ++i) {
    const double q = 0.3 + 0.1 * (i % 7);
    ASSERT_EQ(rig.hand->write(MiaRig::move(q, q, q), transport::now()), IoStatus::kDone);
    ASSERT_NE(rig.hand->read(rig.state), IoStatus::kDisconnected);
  }
  const double elapsed_s = to_seconds(transport::now() - start);
  EXPECT_LE(static_cast<double>(rig.hand->counters().commands - before), elapsed_s / 0.004 + 2.0);
}

TEST(MiaStreaming, StopIsZeroSpeedToEachMotorUntilItStandsAndIsLatched) {
  MiaRig rig(quick_config(), sim::older_mia());
  const HandCommand far = MiaRig::move(1.1, 1.3, 1.3, seconds(60));
  ASSERT_EQ(rig.hand->write(far, transport::now()), IoStatus::kDone);
  ASSERT_TRUE(rig.turn_until([&] { return rig.simulator.motor_counts()[2] > 30.0; }));
  const TimePoint stopped = transport::now();
  ASSERT_EQ(rig.hand->write(MiaRig::plain(HandAction::kStop), stopped), IoStatus::kDone);
  EXPECT_TRUE(rig.hand->stopped());
  EXPECT_EQ(rig.hand->write(far, transport::now()), IoStatus::kRefused) << "latched at once";
  ASSERT_TRUE(rig.turn_until([&] { return transport::now() > stopped + milliseconds(450); }));
  EXPECT_TRUE(rig.hand->standing_still());
  const auto log = rig.simulator.log();
  EXPECT_LT(log.back().q_rad[2], 0.9) << "stopped on the way";
  for (const sim::MiaSample& sample : log) {
    if (sample.t < stopped + milliseconds(300)) continue;  // zero speed lets a motor run out
    for (std::size_t i = 0; i < mia::kMotors; ++i) ASSERT_NEAR(sample.q_rad[i], log.back().q_rad[i], 1e-3);
  }
  EXPECT_EQ(rig.hand->counters().stops, 1u) << "heard: not said again";
  ASSERT_EQ(rig.hand->write(MiaRig::plain(HandAction::kHold), transport::now()), IoStatus::kDone);
  EXPECT_TRUE(rig.hand->stopped());
  EXPECT_EQ(rig.hand->write(far, transport::now()), IoStatus::kDone);
  ASSERT_TRUE(rig.turn_until([&] { return rig.simulator.joint_angles_rad()[2] > 1.25; })) << "moves again";
}

TEST(MiaStreaming, SilenceForASecondEndsTheSession) {
  MiaRig rig(quick_config(), sim::older_mia());
  ASSERT_TRUE(rig.next_reply());
  rig.simulator.mute(true);
  const TimePoint start = transport::now();
  ASSERT_TRUE(rig.turn_until([&] { return rig.turn() == IoStatus::kDisconnected; }));
  EXPECT_GE(transport::now() - start, milliseconds(900));
  EXPECT_LT(transport::now() - start, milliseconds(1500));
  EXPECT_NE(rig.hand->reason().find("no line"), std::string_view::npos) << rig.hand->reason();
  EXPECT_FALSE(rig.hand->calibration_in_doubt());
  rig.simulator.mute(false);
  const auto again = rig.hand->connect();
  ASSERT_TRUE(again.ok()) << again.error().detail.view();
  rig.info = *again;
  EXPECT_FALSE(rig.hand->calibration_in_doubt());
  EXPECT_TRUE(rig.next_reply());
}

TEST(MiaStreaming, AShortSilenceIsSurvivedButNothingMovesBlindly) {
  MiaRig rig(quick_config(), sim::older_mia());
  ASSERT_TRUE(rig.next_reply());
  rig.simulator.mute(true);
  const TimePoint start = transport::now();
  ASSERT_TRUE(rig.turn_until([&] { return transport::now() > start + milliseconds(450); }));
  EXPECT_EQ(rig.hand->write(MiaRig::move(0.5, 0.5, 0.5), transport::now()), IoStatus::kRefused);
  rig.simulator.mute(false);
  ASSERT_TRUE(rig.next_reply());
  EXPECT_EQ(rig.hand->write(MiaRig::move(0.5, 0.5, 0.5), transport::now()), IoStatus::kDone);
  const TimePoint later = transport::now() + milliseconds(400);
  ASSERT_TRUE(rig.turn_until([&] { return transport::now() > later; }));
  EXPECT_FALSE(rig.hand->calibration_in_doubt());
}

TEST(MiaStreaming, StreamsOnlyWhatIsAskedForAndIsQuietAfterwards) {
  mia::MiaConfig config = quick_config();
  config.telemetry.every_cycles = 1;
  MiaRig rig(config, sim::older_mia());
  ASSERT_TRUE(rig.turn_until(
      [&] { return rig.hand->telemetry().current_samples > 3 && rig.hand->telemetry().force_samples > 3; }));
  EXPECT_EQ(rig.hand->telemetry().current[0], 20);
  EXPECT_NEAR(rig.hand->telemetry().force[2].normal, 260, 40);
  rig.hand.reset();
  const TimePoint later = transport::now() + milliseconds(50);
  while (transport::now() < later) {
  }
  auto next = mia::MiaConfig(config);
  next.device = rig.simulator.device();
  next.telemetry.every_cycles = 0;
  rig.hand.emplace(next);
  const auto info = rig.hand->connect();
  ASSERT_TRUE(info.ok());
  rig.info = *info;
  const std::uint64_t before = rig.replies;
  ASSERT_TRUE(rig.turn_until([&] { return rig.replies > before + 5; }));
  EXPECT_EQ(rig.hand->telemetry().current_samples, 0u);
}

TEST(MiaStreaming, ReadAndWriteDoNotTouchTheHeap) {
  if (!counts_heap()) GTEST_SKIP() << "sanitizers own malloc";
  mia::MiaConfig config = quick_config();
  config.telemetry.every_cycles = 1;
  MiaRig rig(config, sim::older_mia());
  std::uint64_t used = 0;
  const TimePoint start = transport::now();
  for (int i = 0; transport::now() < start + milliseconds(500); ++i) {
    const double q = 0.1 * (i % 10);
    HandCommand command = MiaRig::move(q, q, q);
    if (i == 30) command.action = HandAction::kStop;
    const std::uint64_t before = heap_allocations();
    ASSERT_NE(rig.hand->write(command, transport::now()), IoStatus::kDisconnected);
    const IoStatus status = rig.hand->read(rig.state);
    used += heap_allocations() - before;
    if (status == IoStatus::kDone) ++rig.replies;
    static_cast<void>(transport::wait_readable(rig.info.fd, transport::now() + milliseconds(3)));
  }
  EXPECT_GT(rig.replies, 5u);
  EXPECT_EQ(used, 0u);
}

TEST(MiaStreaming, DestructorStopsTheMotors) {
  MiaRig rig(quick_config(), sim::older_mia());
  ASSERT_EQ(rig.hand->write(MiaRig::move(1.1, 1.3, 1.3), transport::now()), IoStatus::kDone);
  ASSERT_TRUE(rig.turn_until([&] { return rig.simulator.motor_counts()[2] > 20.0; }));
  rig.hand.reset();
  const TimePoint later = transport::now() + milliseconds(300);
  while (transport::now() < later) {
  }
  const auto counts = rig.simulator.motor_counts();
  EXPECT_LT(counts[2], 180.0);
  const TimePoint much_later = transport::now() + milliseconds(100);
  while (transport::now() < much_later) {
  }
  EXPECT_NEAR(rig.simulator.motor_counts()[2], counts[2], 0.5);
}

}  // namespace
}  // namespace embody::test
