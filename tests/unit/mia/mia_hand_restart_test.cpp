// A hand that restarts while in use, and what it takes to move it again.
#include <gtest/gtest.h>

#include "tests/unit/mia/rig.hpp"

namespace embody::test {
namespace {

using std::chrono::seconds;

sim::MiaSimulatorConfig posed(sim::MiaSimulatorConfig config = {}) {
  config.start_counts = {100.0, -120.0, 80.0};
  config.boot_time = milliseconds(60);
  return config;
}

/// Holds until the session is over; its length, or nothing after 5 s.
std::optional<Duration> until_lost(MiaRig& rig, const std::function<HandCommand()>& command) {
  const TimePoint start = transport::now();
  while (transport::now() < start + seconds(5)) {
    const TimePoint next = transport::now() + milliseconds(50);
    if (rig.hand->write(command(), transport::now()) == IoStatus::kDisconnected) return transport::now() - start;
    while (transport::now() < next) {
      if (rig.turn() == IoStatus::kDisconnected) return transport::now() - start;
    }
  }
  return std::nullopt;
}

/// Holds until the driver has seen the hand standing still.
void settle(MiaRig& rig) {
  ASSERT_TRUE(rig.turn_until([&] {
    static_cast<void>(rig.hand->write(MiaRig::plain(HandAction::kHold), transport::now()));
    return rig.replies >= 3 && rig.hand->standing_still();
  }));
}

void reconnect(MiaRig& rig) {
  const auto info = rig.hand->connect();
  ASSERT_TRUE(info.ok()) << info.error().detail.view();
  rig.info = *info;
}

class MiaHandRestart : public ::testing::TestWithParam<mia::Generation> {
 protected:
  [[nodiscard]] static sim::MiaSimulatorConfig simulated() {
    return posed(GetParam() == mia::Generation::kStreaming ? sim::older_mia() : sim::MiaSimulatorConfig{});
  }
};

TEST_P(MiaHandRestart, IsNoticedEndsTheSessionAndMotionWaitsForTheOperator) {
  MiaRig rig(quick_config(), simulated());
  ASSERT_EQ(rig.hand->generation(), GetParam());
  settle(rig);
  ASSERT_TRUE(rig.simulator.fault("reboot").ok());
  const auto after = until_lost(rig, [] { return MiaRig::plain(HandAction::kHold); });
  ASSERT_TRUE(after);
  RecordProperty("detected_after_ms", static_cast<int>(after->count() / 1'000'000));
  EXPECT_LT(*after, seconds(1));
  // A hand that starts in less than the patience of the driver is caught in the session, a slower one on connecting.
  reconnect(rig);
  EXPECT_TRUE(rig.hand->calibration_in_doubt());
  EXPECT_EQ(rig.hand->counters().restarts, 1u);
  EXPECT_NE(rig.info.peer.view().find("CALIBRATION"), std::string_view::npos) << rig.info.peer.view();

  const auto before = rig.simulator.motor_counts();
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(rig.hand->write(MiaRig::move(0.5, 0.5, 0.5), transport::now()), IoStatus::kRefused);
    ASSERT_EQ(rig.hand->write(MiaRig::plain(HandAction::kHold), transport::now()), IoStatus::kDone);
    ASSERT_TRUE(rig.next_reply()) << "positions are read all the same";
  }
  EXPECT_EQ(rig.simulator.counters().motions, 0u);
  EXPECT_EQ(rig.simulator.motor_counts(), before);
  rig.hand->confirm_calibration();
  EXPECT_TRUE(rig.cycle(MiaRig::move(0.5, 0.5, 0.5)));
  EXPECT_TRUE(rig.turn_until([&] { return rig.simulator.counters().motions >= 3; }));
}

TEST_P(MiaHandRestart, ByAWeakSupplyStopsTheHandWhereItIs) {
  MiaRig rig(quick_config(), simulated());
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  ASSERT_TRUE(rig.simulator.fault("undervoltage on").ok());
  const auto before = rig.simulator.motor_counts();
  const auto after = until_lost(rig, [] { return MiaRig::move(0.2, 0.2, 0.2); });
  ASSERT_TRUE(after);
  RecordProperty("detected_after_ms", static_cast<int>(after->count() / 1'000'000));
  EXPECT_LT(*after, milliseconds(1500));
  reconnect(rig);
  EXPECT_TRUE(rig.hand->calibration_in_doubt());
  EXPECT_EQ(rig.simulator.motor_counts(), before);
}

INSTANTIATE_TEST_SUITE_P(Generations, MiaHandRestart,
                         ::testing::Values(mia::Generation::kAcknowledging, mia::Generation::kStreaming),
                         [](const auto& param) {
                           return std::string(param.param == mia::Generation::kStreaming ? "streaming"
                                                                                         : "acknowledging");
                         });

TEST(MiaHandRestartReason, TellsTheOperatorWhatToDo) {
  sim::MiaSimulatorConfig config = posed();
  config.boot_time = milliseconds(5);
  MiaRig rig(patient_config(), config);
  settle(rig);
  ASSERT_TRUE(rig.simulator.fault("reboot").ok());
  ASSERT_TRUE(until_lost(rig, [] { return MiaRig::plain(HandAction::kHold); }));
  for (const char* word : {"restarted", "supply", "calibrat", "confirm"}) {
    EXPECT_NE(rig.hand->reason().find(word), std::string_view::npos) << rig.hand->reason();
  }
  EXPECT_EQ(rig.hand->counters().implausible, 2u);
}

TEST(MiaHandRestartReason, TheOperatorsStandingWordLetsItMove) {
  mia::MiaConfig config = quick_config();
  config.motion_after_restart = true;
  MiaRig rig(config, posed());
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  ASSERT_TRUE(rig.simulator.fault("reboot").ok());
  ASSERT_TRUE(until_lost(rig, [] { return MiaRig::plain(HandAction::kHold); }));
  reconnect(rig);
  EXPECT_FALSE(rig.hand->calibration_in_doubt());
  EXPECT_TRUE(rig.cycle(MiaRig::move(0.2, 0.2, 0.2)));
}

TEST(MiaHandCalibration, MovesOnlyWhenAskedForAndFindsTheTruthAgain) {
  sim::MiaSimulatorConfig config = posed();
  config.calibration_time = milliseconds(1200);
  MiaRig rig(patient_config(), config);
  ASSERT_TRUE(rig.simulator.fault("reboot").ok());
  static_cast<void>(until_lost(rig, [] { return MiaRig::plain(HandAction::kHold); }));
  reconnect(rig);
  EXPECT_EQ(rig.simulator.counters().calibrations, 0u) << "never by itself";
  const Status done = rig.hand->calibrate();
  ASSERT_TRUE(done.ok()) << done.error().detail.view();
  EXPECT_EQ(rig.simulator.counters().calibrations, 1u);
  EXPECT_EQ(rig.simulator.counters().stores, 0u) << "the EEPROM is never written";
  for (const double counts : rig.simulator.motor_counts()) EXPECT_NEAR(counts, 0.0, 0.5);
  EXPECT_TRUE(rig.hand->calibration_in_doubt()) << "the operator looks at the light first";
  rig.hand->confirm_calibration();
  const double counts = std::round(mia::motor_counts({}, {0.5, 0.5, 0.5})[2]);
  EXPECT_TRUE(rig.arrives(MiaRig::move(0.5, 0.5, 0.5), 2, counts)) << "where it says, not elsewhere";
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kStop)));
  const Status refused = rig.hand->calibrate();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, Errc::kRefused) << "a stopped hand does not calibrate";
}

TEST(MiaHandCalibration, NeedsAConnectedHandOfTheNewerFirmware) {
  MiaRig older(quick_config(), sim::older_mia());
  const Status unsupported = older.hand->calibrate();
  ASSERT_FALSE(unsupported.ok());
  EXPECT_EQ(unsupported.error().code, Errc::kUnsupported);
  mia::MiaConfig config;
  config.device = "/dev/ttyUSB_not_there";
  const Status absent = mia::MiaHand(config).calibrate();
  ASSERT_FALSE(absent.ok());
  EXPECT_EQ(absent.error().code, Errc::kDisconnected);
}

}  // namespace
}  // namespace embody::test
