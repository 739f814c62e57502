// The simulated hand: generations, faults by name, contacts, calibration, restarts. In simulated time.
#include <gtest/gtest.h>

#include <cmath>

#include "drivers/sim/mia/device.hpp"

namespace embody::sim {
namespace {

using mia::Motor;
using std::chrono::milliseconds;

/// A hand and a host that sends one command and waits 20 ms for what is said.
struct Bench {
  explicit Bench(const MiaSimulatorConfig& config = {}) : hand(config, now) {}

  std::string say(const mia::Command& command, Duration wait = milliseconds(20)) {
    hand.receive({command.data(), command.size()}, now);
    now += wait;
    return hand.advance(now);
  }
  std::string say(std::string_view payload, Duration wait = milliseconds(20)) {
    return say(mia::encode_plain(payload), wait);
  }
  std::array<int, 3> positions() {
    return mia::parse_triple(say("ADPo"), mia::TripleLine::kPosition).value_or(std::array<int, 3>{-1, -1, -1});
  }
  std::array<int, 3> currents() {
    return mia::parse_triple(say("ADCo"), mia::TripleLine::kCurrent).value_or(std::array<int, 3>{-1, -1, -1});
  }
  void fault(std::string_view text) {
    const Status done = hand.fault(text, now);
    EXPECT_TRUE(done.ok()) << done.error().detail.view();
  }

  TimePoint now{std::chrono::seconds(1000)};
  MiaDevice hand;
};

TEST(MiaDeviceGenerations, OlderFirmwareIgnoresWhatOnlyNewerFirmwareKnows) {
  Bench older(older_mia());
  EXPECT_EQ(older.say("ADPo").size(), mia::kAckSize) << "an ACK, no data";
  EXPECT_EQ(older.say("SR").size(), mia::kAckSize);
  older.say(mia::encode_joint_position(Motor::kMrl, 1.0, 60), milliseconds(1000));
  EXPECT_EQ(older.hand.motor_counts()[2], 0.0);
  older.say(mia::encode_motor_position(Motor::kMrl, 200, 60), milliseconds(100));
  older.say("AS", milliseconds(1000));
  EXPECT_NEAR(older.hand.motor_counts()[2], 200.0, 0.1) << "it knows no stop";
  MiaSimulatorConfig silent = older_mia();
  silent.acks_all = false;
  EXPECT_EQ(Bench(silent).say("?AreYouPlugged?"), "");
}

TEST(MiaDeviceGenerations, GraspsReferencesAndTheEepromAreAcknowledged) {
  Bench bench;
  EXPECT_EQ(bench.say("ES").size(), mia::kAckSize);
  EXPECT_EQ(bench.hand.counters().stores, 1u);
  bench.say(mia::encode_grasp_references(Motor::kMrl, 'C', 20, 120));
  const std::string said = bench.say(mia::encode_get_grasp_references(Motor::kMrl, 'C'));
  EXPECT_EQ(mia::parse_grasp_references(said), (mia::GraspReferences{20, 120, 0}));
  bench.say(mia::encode_grasp('C', 50, 60), milliseconds(2000));
  EXPECT_NEAR(bench.hand.motor_counts()[2], 70.0, 0.1);
}

TEST(MiaDeviceFaults, TouchTheNumberOfLinesTheyName) {
  Bench bench;
  const std::string good = bench.say("ADPo");
  bench.fault("drop_ack 1");
  EXPECT_EQ(bench.say("ADPo"), good.substr(mia::kAckSize)) << "the data comes all the same";
  bench.fault("drop 2");
  EXPECT_EQ(bench.say("ADPo"), "");
  bench.fault("garble 1");
  EXPECT_EQ(bench.say("ADPo"), "<###############\n" + good.substr(mia::kAckSize));
  bench.fault("echo_wrong 1");
  EXPECT_FALSE(mia::acknowledges(bench.say("ADPo").substr(0, mia::kAckSize), mia::encode_plain("ADPo")));
  bench.fault("rubbish 40");
  const std::string with_rubbish = bench.say("ADPo");
  EXPECT_EQ(with_rubbish.size(), good.size() + 40);
  EXPECT_EQ(with_rubbish.substr(40), good);
  bench.fault("mute on");
  EXPECT_EQ(bench.say("ADPo"), "");
  bench.fault("mute off");
  EXPECT_EQ(bench.say("ADPo"), good);
  bench.fault("delay 30");
  EXPECT_EQ(bench.say("ADPo"), "");
  bench.now += milliseconds(10);
  EXPECT_EQ(bench.hand.advance(bench.now), good);
}

TEST(MiaDeviceFaults, AckDelaysSpreadOverTheJitterAndKeepTheirOrder) {
  MiaSimulatorConfig config;
  config.ack_jitter = milliseconds(10);
  Bench bench(config);
  Duration least = milliseconds(100), most{0};
  for (int i = 0; i < 200; ++i) {
    const TimePoint sent = bench.now;
    bench.hand.receive({mia::encode_plain("AS").data(), mia::kCommandSize}, sent);
    const Duration delay = *bench.hand.next_event() - sent;
    least = std::min(least, delay);
    most = std::max(most, delay);
    bench.now += milliseconds(20);
    bench.hand.advance(bench.now);
  }
  EXPECT_GE(least, milliseconds(2));
  EXPECT_LT(least, milliseconds(4));
  EXPECT_GT(most, milliseconds(10));
  EXPECT_LE(most, milliseconds(12));
}

TEST(MiaDeviceFaults, UnknownTextsAreRefusedWithTheNamesThatExist) {
  Bench bench;
  for (const char* wrong :
       {"", "fly", "drop", "drop x", "drop -1", "drop 100001", "mute", "mute maybe", "stall", "stall ring on",
        "stall mrl", "contact mrl x", "reboot now", "delay 5 ms", "drop 1 2 3 4", "streams on"}) {
    const Status refused = bench.hand.fault(wrong, bench.now);
    ASSERT_FALSE(refused.ok()) << wrong;
    EXPECT_EQ(refused.error().code, Errc::kInvalidArgument);
    EXPECT_NE(refused.error().detail.view().find("echo_wrong"), std::string_view::npos);
  }
}

TEST(MiaDeviceRestart, ZeroesCountersAndEndsStreamsUntilACalibrationFindsTheTruthAgain) {
  MiaSimulatorConfig config;
  config.start_counts = {100, -80, 60};
  Bench bench(config);
  EXPECT_EQ(bench.positions(), (std::array<int, 3>{100, -80, 60}));
  bench.say("ADP1");
  bench.fault("reboot");
  EXPECT_EQ(bench.say("ADPo", milliseconds(150)), "") << "still starting";
  EXPECT_EQ(bench.hand.next_event(), std::nullopt) << "streams are off";
  bench.now += milliseconds(60);
  EXPECT_EQ(bench.positions(), (std::array<int, 3>{0, 0, 0}));
  EXPECT_EQ(bench.hand.motor_counts(), config.start_counts) << "it has not moved";
  bench.say(mia::encode_motor_position(Motor::kMrl, 100, 60), milliseconds(2000));
  EXPECT_NEAR(bench.hand.motor_counts()[2], 160.0, 0.1) << "a wrong counter leads astray";
  bench.say("AF", milliseconds(1000));
  bench.say(mia::encode_motor_position(Motor::kMrl, 100, 60), milliseconds(1500));
  EXPECT_EQ(bench.hand.counters().calibrations, 1u);
  EXPECT_EQ(bench.positions(), (std::array<int, 3>{0, 0, 0})) << "positions sent meanwhile are ignored";
  EXPECT_NEAR(bench.hand.motor_counts()[2], 0.0, 0.5);
}

TEST(MiaDeviceRestart, AWeakSupplyFailsWhenAMotorIsToMove) {
  Bench bench;
  bench.fault("undervoltage");
  EXPECT_NE(bench.say("ADPo"), "");
  EXPECT_EQ(bench.say(mia::encode_motor_position(Motor::kMrl, 100, 60), milliseconds(500)), "");
  EXPECT_EQ(bench.hand.counters().restarts, 1u);
  EXPECT_EQ(bench.hand.motor_counts()[2], 0.0);
}

TEST(MiaDeviceContact, StopsTheFingerAndRaisesTheCurrentToItsLimit) {
  Bench bench;
  bench.fault("contact mrl 90");
  bench.say(mia::encode_motor_position(Motor::kMrl, 200, 40), milliseconds(1500));
  EXPECT_EQ(bench.hand.motor_counts()[2], 90.0);
  EXPECT_EQ(bench.currents()[2], 410) << "40 % of 1024";
  EXPECT_LT(bench.currents()[0], 50);
  bench.say(mia::encode_motor_position(Motor::kMrl, 20, 40), milliseconds(1500));
  EXPECT_NEAR(bench.hand.motor_counts()[2], 20.0, 0.1) << "opening is free";
  bench.fault("stall mrl on");
  bench.say(mia::encode_motor_position(Motor::kMrl, 0, 40), milliseconds(500));
  EXPECT_NEAR(bench.hand.motor_counts()[2], 20.0, 0.1);
  EXPECT_EQ(bench.currents()[2], 410);
  bench.fault("stall mrl off");
  bench.now += milliseconds(1000);
  bench.hand.advance(bench.now);
  EXPECT_NEAR(bench.hand.motor_counts()[2], 0.0, 0.1);
}

TEST(MiaDeviceSensors, StrainGaugesIdleWithNoiseAndRiseInContact) {
  Bench bench;
  double sum = 0.0, squares = 0.0;
  constexpr int kSamples = 1000;
  for (int i = 0; i < kSamples; ++i) {
    const auto strain = mia::parse_strain_gauges(bench.say("ADAo"));
    ASSERT_TRUE(strain);
    sum += (*strain)[5];
    squares += (*strain)[5] * (*strain)[5];
    ASSERT_EQ((*strain)[6], 0);
  }
  const double mean = sum / kSamples;
  EXPECT_NEAR(mean, 260.0, 1.0);
  EXPECT_NEAR(std::sqrt(squares / kSamples - mean * mean), 4.5, 0.5);
  bench.fault("contact mrl 50");
  bench.say(mia::encode_motor_position(Motor::kMrl, 200, 40), milliseconds(1500));
  EXPECT_GT((*mia::parse_strain_gauges(bench.say("ADAo")))[5], 340);
}

}  // namespace
}  // namespace embody::sim
