// Joint space, telemetry, and a line that delays, drops, repeats and invents: acknowledging firmware.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/mia/rig.hpp"

namespace embody::test {
namespace {

using std::chrono::seconds;

/// Cycles of 50 ms, as the daemon runs them; how many of them brought no position.
int run_cycles(MiaRig& rig, int cycles, const std::function<HandCommand()>& command) {
  int without = 0;
  for (int i = 0; i < cycles; ++i) {
    const TimePoint next = transport::now() + milliseconds(50);
    const std::uint64_t before = rig.replies;
    if (rig.hand->write(command(), transport::now()) == IoStatus::kDisconnected) return cycles;
    while (transport::now() < next) {
      if (rig.turn() == IoStatus::kDisconnected) return cycles;
    }
    if (rig.replies == before) ++without;
  }
  return without;
}

TEST(MiaJointSpace, SendsAndReadsAnglesRoundedToHundredths) {
  mia::MiaConfig config = patient_config();
  config.space = mia::Space::kJoint;
  // The hand has its own calibration: what the driver believes of the counts does not matter.
  config.transmission.mrl.zero_counts = 5.0;
  sim::MiaSimulatorConfig simulated;
  simulated.transmission.thumb.rad_per_count = 0.0046;
  MiaRig rig(config, simulated);
  EXPECT_NE(rig.info.peer.view().find("joint space"), std::string_view::npos);
  const std::array<double, 3> target_rad{0.456, -0.657, 1.019};
  ASSERT_TRUE(rig.turn_until([&] {
    static_cast<void>(rig.hand->write(MiaRig::move(target_rad[0], target_rad[1], target_rad[2]), transport::now()));
    const auto q_rad = rig.simulator.joint_angles_rad();
    return std::abs(q_rad[0] - 0.46) < 1e-3 && std::abs(q_rad[1] + 0.66) < 1e-3 && std::abs(q_rad[2] - 1.02) < 1e-3;
  }));
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  EXPECT_NEAR(rig.state.q_rad[0], 0.46, 1e-9);
  EXPECT_NEAR(rig.state.q_rad[1], -0.66, 1e-9);
  EXPECT_NEAR(rig.state.q_rad[2], 1.02, 1e-9);
  EXPECT_NEAR(rig.hand->thumb_opposition(), -0.6283, 1e-3);
}

TEST(MiaTelemetryOnTheLine, ComesEveryFewCyclesAndDelaysNoMotion) {
  mia::MiaConfig config = patient_config();
  config.telemetry.every_cycles = 2;
  sim::MiaSimulatorConfig simulated;
  simulated.contact_counts[2] = 60.0;
  MiaRig rig(config, simulated);
  int i = 0;
  const auto command = [&i] {
    const double q = 0.5 + 0.02 * (i++ % 5);
    return MiaRig::move(q, q, 1.0);
  };
  EXPECT_LE(run_cycles(rig, 32, command), 3);
  const mia::MiaTelemetry& data = rig.hand->telemetry();
  EXPECT_GE(data.current_samples, 5u);
  EXPECT_GE(data.force_samples, 5u);
  EXPECT_LE(data.current_samples + data.force_samples, 16u);
  EXPECT_EQ(data.current[2], 614) << "60 % of 1024: blocked by the object";
  EXPECT_LT(data.current[0], 200);
  EXPECT_NEAR(data.force[2].normal, 260 + 120, 30);
  EXPECT_EQ(rig.hand->counters().timeouts, 0u);
  EXPECT_EQ(rig.simulator.counters().dropped_as_early, 0u);
}

TEST(MiaTelemetryOnTheLine, TareMakesTheIdleForceZero) {
  mia::MiaConfig config = patient_config();
  config.telemetry.every_cycles = 1;
  config.telemetry.currents = false;
  MiaRig rig(config);
  rig.hand->tare();
  run_cycles(rig, 12, [] { return MiaRig::plain(HandAction::kHold); });
  ASSERT_EQ(rig.hand->telemetry().tares, 1u);
  for (const mia::FingerForce& force : rig.hand->telemetry().force) {
    EXPECT_NEAR(force.normal, 0, 25);
    EXPECT_NEAR(force.tangential, 0, 25);
  }
}

TEST(MiaLineFaults, ACommandThatWasNotHeardIsSentAgainAtOnce) {
  MiaRig rig(quick_config());
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  ASSERT_TRUE(rig.simulator.fault("deaf 1").ok());
  ASSERT_TRUE(rig.cycle(MiaRig::move(0.0, 0.0, 0.8)));
  ASSERT_TRUE(rig.turn_until([&] { return rig.simulator.counters().motions >= 3; }, milliseconds(300)));
  EXPECT_GE(rig.hand->counters().retries, 1u);
}

TEST(MiaLineFaults, ARetryIsNotMadeForMotionThatIsHeldMeanwhile) {
  MiaRig rig(quick_config());
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  const std::uint64_t retries = rig.hand->counters().retries;
  ASSERT_TRUE(rig.simulator.fault("deaf 1").ok());
  ASSERT_EQ(rig.hand->write(MiaRig::move(0.5, 0.5, 0.5), transport::now()), IoStatus::kDone);
  ASSERT_EQ(rig.hand->write(MiaRig::plain(HandAction::kHold), transport::now()), IoStatus::kDone);
  ASSERT_TRUE(rig.next_reply());
  EXPECT_EQ(rig.simulator.counters().motions, 0u);
  EXPECT_EQ(rig.hand->counters().retries, retries);
}

TEST(MiaLineFaults, TheEchoOfAnotherCommandIsNoAck) {
  MiaRig rig(quick_config());
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  ASSERT_TRUE(rig.simulator.fault("echo_wrong 1").ok());
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  EXPECT_GE(rig.hand->counters().late_acks, 1u);
  EXPECT_GE(rig.hand->counters().retries, 1u);
}

TEST(MiaLineFaults, RubbishBetweenLinesIsPassedOver) {
  MiaRig rig(quick_config());
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(rig.simulator.fault("rubbish 300").ok());
    ASSERT_TRUE(rig.cycle(MiaRig::move(0.4, 0.4, 0.4))) << i;
  }
  EXPECT_EQ(rig.hand->counters().implausible, 0u);
}

TEST(MiaLineFaults, AnswersThatAreALittleLateAreUsedAndNeverMistaken) {
  // 30 ms instead of 20: every command is sent twice, and every second answer comes when something else is awaited.
  MiaRig rig(quick_config());
  ASSERT_TRUE(rig.simulator.fault("delay 30").ok());
  const double counts = std::round(mia::motor_counts({}, {0.5, 0.6, 0.7})[2]);
  const TimePoint deadline = transport::now() + seconds(8);
  while (std::abs(rig.simulator.motor_counts()[2] - counts) > 0.5 && transport::now() < deadline) {
    ASSERT_LT(run_cycles(rig, 1, [] { return MiaRig::move(0.5, 0.6, 0.7); }), 2);
  }
  EXPECT_NEAR(rig.simulator.motor_counts()[2], counts, 0.5);
}

TEST(MiaLineFaults, AHandThatAnswersMuchTooLateIsGivenUpWithTheDelayInTheReason) {
  MiaRig rig(quick_config());
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  ASSERT_TRUE(rig.simulator.fault("half_duplex off").ok());
  ASSERT_TRUE(rig.simulator.fault("delay 55").ok());
  const TimePoint start = transport::now();
  run_cycles(rig, 40, [] { return MiaRig::plain(HandAction::kHold); });
  EXPECT_EQ(rig.hand->read(rig.state), IoStatus::kDisconnected);
  EXPECT_LT(transport::now() - start, seconds(2));
  EXPECT_NE(rig.hand->reason().find(" ms"), std::string_view::npos) << rig.hand->reason();
  EXPECT_NE(rig.hand->reason().find("low-latency"), std::string_view::npos) << rig.hand->reason();
}

TEST(MiaLineFaults, AScatteredAckTimeWithinTheLimitCostsNothing) {
  sim::MiaSimulatorConfig simulated;
  simulated.ack_delay = milliseconds(1);
  simulated.ack_jitter = milliseconds(6);
  MiaRig rig(patient_config(), simulated);
  int i = 0;
  run_cycles(rig, 20, [&i] { return MiaRig::move(0.2 + 0.02 * i++, 0.3, 0.4); });
  EXPECT_EQ(rig.hand->counters().timeouts, 0u);
  EXPECT_EQ(rig.simulator.counters().dropped_as_early, 0u);
}

TEST(MiaLineFaults, UnpluggedInMotionTheHandEndsAtItsLastTargetAndReconnectingMovesNothing) {
  const std::string link = ::testing::TempDir() + "embody_mia_motion_" + std::to_string(::getpid());
  sim::MiaSimulatorConfig simulated;
  simulated.link = link;
  MiaRig rig(patient_config(), simulated);
  const double target = std::round(mia::motor_counts({}, {0.5, 0.5, 0.9})[2]);
  ASSERT_TRUE(rig.cycle(MiaRig::move(0.5, 0.5, 0.9)));
  ASSERT_TRUE(rig.turn_until([&] { return rig.simulator.motor_counts()[2] > 20.0; }));
  ASSERT_TRUE(rig.simulator.fault("unplug").ok());
  EXPECT_EQ(rig.hand->read(rig.state), IoStatus::kDisconnected) << "at once";
  EXPECT_NE(rig.hand->reason().find("unplugged"), std::string_view::npos);
  const TimePoint deadline = transport::now() + seconds(5);
  while (rig.simulator.motor_counts()[2] < target - 0.5 && transport::now() < deadline) {
  }
  ASSERT_TRUE(rig.simulator.fault("plug").ok());
  mia::MiaConfig config = patient_config();
  config.device = link;
  rig.hand.emplace(config);
  const auto info = rig.hand->connect();
  ASSERT_TRUE(info.ok()) << info.error().detail.view();
  rig.info = *info;
  const std::uint64_t motions = rig.simulator.counters().motions;
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  EXPECT_NEAR(rig.simulator.motor_counts()[2], target, 0.5) << "no further than its last target";
  EXPECT_EQ(rig.simulator.counters().motions, motions);
}

TEST(MiaStop, IsAskedAgainUntilTheHandStandsStill) {
  MiaRig rig(quick_config());
  ASSERT_TRUE(rig.cycle(MiaRig::move(1.1, 1.3, 1.3)));
  ASSERT_TRUE(rig.turn_until([&] { return rig.simulator.motor_counts()[2] > 20.0; }));
  ASSERT_TRUE(rig.simulator.fault("drop_ack 3").ok());  // three of the four tries stay without an answer
  const TimePoint start = transport::now();
  ASSERT_EQ(rig.hand->write(MiaRig::plain(HandAction::kStop), start), IoStatus::kDone);
  const std::uint64_t before = rig.replies;
  // Nobody writes any more: the driver asks by itself.
  ASSERT_TRUE(rig.turn_until([&] { return rig.replies >= before + 3 && rig.hand->standing_still(); }, seconds(2)));
  EXPECT_GE(rig.simulator.counters().stops, 4u);
  EXPECT_LT(transport::now() - start, seconds(1));
}

TEST(MiaStop, ZeroSpeedStopsAHandThatDoesNotKnowTheStopCommand) {
  MiaRig rig(quick_config());
  ASSERT_TRUE(rig.cycle(MiaRig::move(1.1, 1.3, 1.3)));
  ASSERT_TRUE(rig.turn_until([&] { return rig.simulator.motor_counts()[2] > 20.0; }));
  ASSERT_TRUE(rig.simulator.fault("deaf 4").ok());  // all tries of the stop command
  const TimePoint start = transport::now();
  ASSERT_EQ(rig.hand->write(MiaRig::plain(HandAction::kStop), start), IoStatus::kDone);
  ASSERT_TRUE(
      rig.turn_until([&] { return rig.hand->standing_still() && transport::now() > start + milliseconds(300); }));
  RecordProperty("stands_after_ms", static_cast<int>((transport::now() - start).count() / 1'000'000));
  EXPECT_EQ(rig.simulator.counters().stops, 0u);
  const auto log = rig.simulator.log();
  EXPECT_LT(log.back().q_rad[2], 1.2) << "stopped on the way";
  for (const sim::MiaSample& sample : log) {
    if (sample.t < start + milliseconds(400)) continue;
    for (std::size_t i = 0; i < mia::kMotors; ++i) ASSERT_NEAR(sample.q_rad[i], log.back().q_rad[i], 1e-3);
  }
}

}  // namespace
}  // namespace embody::test
