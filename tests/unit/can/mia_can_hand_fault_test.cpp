// Profile "compact": each fault, how soon it is seen, and that nothing moves that should not.
#include <cmath>

#include "tests/unit/can/compact_rig.hpp"

namespace embody::test {
namespace {

/// A fault that ends the session: what is injected, how long it may take, and a word of the sentence.
struct Ending {
  const char* name;
  const char* fault;
  Duration at_most;
  const char* word;
  const char* repair;
};
void PrintTo(const Ending& ending, std::ostream* out) {
  *out << ending.name;
}

class MiaCanFault : public ::testing::TestWithParam<Ending> {};

// The bounds are those of the configuration (100 ms without states, 5 x 20 ms without acknowledgements) and slack for a
// busy machine.
INSTANTIATE_TEST_SUITE_P(
    Rows, MiaCanFault,
    ::testing::Values(Ending{"busOff", "bus_off", milliseconds(100), "bus-off", nullptr},
                      Ending{"interfaceDown", "down", milliseconds(100), "gone", "up"},
                      Ending{"silent", "silent on", milliseconds(300), "stay away", "silent off"},
                      Ending{"oneMotorSilent", "silent index on", milliseconds(300), "stay away", "silent index off"},
                      Ending{"counterStuck", "counter_stuck on", milliseconds(300), "move on", "counter_stuck off"},
                      Ending{"acksLost", "drop_ack 1000", milliseconds(700), "acknowledges", "drop_ack 0"},
                      Ending{"wrongCrc", "wrong_crc 1000", milliseconds(700), "acknowledges", "wrong_crc 0"},
                      Ending{"underVoltage", "undervoltage on", milliseconds(150), "under-voltage", "undervoltage off"},
                      Ending{"statesGarbled", "garble 100000", milliseconds(300), "stay away", "garble 0"}),
    [](const auto& with) { return std::string(with.param.name); });

TEST_P(MiaCanFault, EndsTheSessionInTimeAndTheNextOneMovesNothing) {
  CompactRig rig(mia::compact::CompactConfig{});
  int n = 0;
  const auto command = [&n] {  // a new target each time, so that there is something to acknowledge
    n = (n + 1) % 50;
    return move(0.3 + 0.01 * n, 0.3, 0.3);
  };
  ASSERT_TRUE(rig.drive(command, [&] { return rig.hand->counters().acks >= 5; })) << rig.hand->reason();
  rig.fault(GetParam().fault);
  const TimePoint start = transport::now();
  ASSERT_FALSE(rig.drive(command, [] { return false; }));
  const Duration took = transport::now() - start;
  std::printf("[ fault    ] %s: %.0f ms, \"%.*s\"\n", GetParam().name, 1e3 * to_seconds(took),
              static_cast<int>(rig.hand->reason().size()), rig.hand->reason().data());
  RecordProperty("detect_ms", static_cast<int>(took.count() / 1'000'000));
  EXPECT_LT(took, GetParam().at_most);
  EXPECT_NE(rig.hand->reason().find(GetParam().word), std::string_view::npos) << rig.hand->reason();
  HandDeviceState state;
  EXPECT_EQ(rig.hand->read(state), IoStatus::kDisconnected);
  EXPECT_EQ(rig.hand->write(command(), transport::now()), IoStatus::kDisconnected);

  if (GetParam().repair != nullptr) rig.fault(GetParam().repair);
  const std::uint64_t motions = rig.simulator->counters().motions;
  rig.connect();
  EXPECT_EQ(rig.simulator->counters().motions, motions) << "reconnecting moves nothing";
  ASSERT_TRUE(rig.drive(command, [&] { return rig.simulator->counters().motions > motions + 3; }));
}

TEST(MiaCanFaults, SurvivesErrorFramesAndSingleLosses) {
  auto config = patient_compact();
  config.ack_timeout = milliseconds(30);
  config.lost_after_timeouts = 20;
  CompactRig rig(config);
  double q = 0.3;
  const auto command = [&q] { return move(q += 0.001, 0.3, 0.3); };
  for (const char* fault : {"error_passive", "no_ack", "drop_ack 2", "wrong_crc 2", "garble 2", "drop_state 4"}) {
    rig.fault(fault);
    const std::uint64_t acks = rig.hand->counters().acks;
    ASSERT_TRUE(rig.drive(command, [&] { return rig.hand->counters().acks >= acks + 4; }))
        << fault << ": " << rig.hand->reason();
  }
  EXPECT_EQ(rig.hand->bus_counters().error_passives, 1u);
  EXPECT_EQ(rig.hand->bus_counters().no_acks, 1u);
  EXPECT_EQ(rig.hand->counters().damaged, 4u) << "two acknowledgements, two states";
  EXPECT_GE(rig.hand->counters().lost_states, 5u);
  EXPECT_GE(rig.hand->counters().timeouts, 4u);
}

TEST(MiaCanFaults, TellsCurrentsForcesAndObjectsAndCountsWhatTheBusDoes) {
  sim::CompactHandConfig simulated;
  CompactRig rig(patient_compact(), simulated);
  HandDeviceState& state = rig.loop->state;
  ASSERT_TRUE(rig.drive([] { return move(0.3, 0.3, 0.3); }, [&] { return state.telemetry.t_force != TimePoint{}; }));
  EXPECT_EQ(state.telemetry.condition, HandCondition::kReady);
  EXPECT_EQ(state.telemetry.supply, HandSupply::kGood);
  EXPECT_FALSE(state.telemetry.current_in_ampere);
  EXPECT_EQ(state.telemetry.current_count, mia::kMotors);
  EXPECT_EQ(state.telemetry.force[1].normal, rig.hand->forces().raw[1]) << "the order of the serial line";
  EXPECT_FALSE(state.telemetry.force[3].measured);

  rig.fault("error_passive");
  ASSERT_TRUE(rig.drive([] { return move(0.3, 0.3, 0.3); }, [&] { return rig.hand->counters().error_frames == 1; }));
  rig.fault("bus_off");
  ASSERT_TRUE(rig.loop->end().has_value());
  EXPECT_EQ(rig.hand->counters().bus_offs, 1u);
  rig.connect();
  EXPECT_EQ(rig.hand->counters().error_frames, 2u) << "counts over sessions";
  rig.fault("undervoltage on");
  ASSERT_TRUE(rig.loop->end().has_value());
  EXPECT_EQ(rig.hand->counters().under_voltages, 1u);
}

TEST(MiaCanFaults, AHandWithoutHeartbeatsStopsAndSaysSo) {
  CompactRig rig;
  ASSERT_TRUE(rig.drive([] { return move(1.0, 1.0, 1.2); }, [&] { return rig.simulator->motor_counts()[2] > 10.0; }));
  // The loop hangs: nobody calls read() or write().
  const TimePoint start = transport::now();
  while (rig.simulator->compact_counters().heartbeat_stops == 0 && transport::now() < start + seconds(5)) {
    static_cast<void>(transport::wait_readable(-1, transport::now() + milliseconds(2)));
  }
  const Duration took = transport::now() - start;
  std::printf("[ fault    ] loopHangs: the hand stops after %.0f ms\n", 1e3 * to_seconds(took));
  EXPECT_GE(took, milliseconds(150)) << "not before three periods, of which one may have begun";
  EXPECT_LT(took, milliseconds(450));
  const auto still = rig.simulator->motor_counts();
  ASSERT_FALSE(rig.drive([] { return move(1.0, 1.0, 1.2); }, [] { return false; }));
  EXPECT_NE(rig.hand->reason().find("heartbeat"), std::string_view::npos) << rig.hand->reason();
  EXPECT_EQ(rig.simulator->motor_counts(), still) << "what was sent meanwhile moved nothing";
  rig.connect();
  EXPECT_EQ(rig.simulator->motor_counts(), still);
}

TEST(MiaCanFaults, ARestartedHandIsRefusedUntilItIsCalibrated) {
  CompactRig rig;
  rig.fault("restart");
  ASSERT_TRUE(rig.loop->end().has_value());
  const auto refused = rig.hand->connect();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, Errc::kRefused);
  EXPECT_NE(refused.error().detail.view().find("calibrate"), std::string_view::npos);
  rig.fault("calibrate");
  rig.connect();
}

TEST(MiaCanFaults, ASilentBusIsGivenUpInTime) {
  CompactRig rig;
  rig.fault("silent on");
  const TimePoint start = transport::now();
  const auto refused = rig.hand->connect();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, Errc::kTimeout);
  EXPECT_LT(transport::now() - start, seconds(4));
}

TEST(MiaCanFaults, UnknownFaultsAreRefusedWithTheNamesThatExist) {
  CompactRig rig;
  for (const char* text : {"", "silent", "silent maybe", "silent toe on", "drop_ack", "drop_ack -1", "drop_ack x",
                           "drop_ack 99999999999", "bus_off now", "restart 1"}) {
    const Status status = rig.simulator->fault(text);
    ASSERT_FALSE(status.ok()) << text;
    EXPECT_EQ(status.error().code, Errc::kInvalidArgument);
  }
}

}  // namespace
}  // namespace embody::test
