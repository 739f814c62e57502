// What a Mia hand tells besides its positions, as configured by default, over a real pseudo-terminal.
#include "tests/unit/mia/rig.hpp"

namespace embody::test {
namespace {

using mia::Generation;

class MiaHandReport : public ::testing::TestWithParam<Generation> {
 protected:
  static sim::MiaSimulatorConfig simulated() {
    return GetParam() == Generation::kStreaming ? sim::older_mia() : sim::MiaSimulatorConfig{};
  }
};
INSTANTIATE_TEST_SUITE_P(Generations, MiaHandReport,
                         ::testing::Values(Generation::kAcknowledging, Generation::kStreaming), [](const auto& row) {
                           return row.param == Generation::kStreaming ? "streaming" : "acknowledging";
                         });

/// 20 Hz, as the hand loop does it, until `done`.
bool run_until(MiaRig& rig, HandAction action, const std::function<bool()>& done,
               Duration limit = std::chrono::seconds(15)) {
  TimePoint t_next = transport::now();
  return rig.turn_until(
      [&] {
        if (transport::now() >= t_next) {
          t_next = transport::now() + milliseconds(50);
          static_cast<void>(rig.hand->write(
              action == HandAction::kMove ? MiaRig::move(0.3, 0.3, 0.3) : MiaRig::plain(action), transport::now()));
        }
        return done();
      },
      limit);
}

TEST_P(MiaHandReport, CurrentsAndForcesComeWithThePositions) {
  MiaRig rig(patient_config(), simulated());
  const HandTelemetry& telemetry = rig.state.telemetry;
  ASSERT_TRUE(run_until(rig, HandAction::kMove,
                        [&] { return telemetry.t_current != TimePoint{} && telemetry.t_force != TimePoint{}; }));
  EXPECT_EQ(telemetry.condition, HandCondition::kReady);
  EXPECT_TRUE(telemetry.why_not.empty());
  EXPECT_EQ(telemetry.supply, HandSupply::kUnknown) << "the hand does not tell";
  EXPECT_FALSE(telemetry.current_in_ampere);
  ASSERT_EQ(telemetry.current_count, mia::kMotors);
  for (std::size_t i = 0; i < mia::kMotors; ++i) {
    EXPECT_EQ(telemetry.current_raw[i], rig.hand->telemetry().current[i]);
    ASSERT_TRUE(telemetry.force[i].measured);
    EXPECT_GT(telemetry.force[i].normal, 100) << "raw numbers of an idle gauge are about 200";
  }
  EXPECT_FALSE(telemetry.force[3].measured || telemetry.force[4].measured) << "no sensors there";
}

TEST_P(MiaHandReport, AStoppedAndARestartedHandSayWhatToDo) {
  MiaRig rig(patient_config(), simulated());
  const HandTelemetry& telemetry = rig.state.telemetry;
  ASSERT_TRUE(run_until(rig, HandAction::kStop, [&] { return telemetry.condition == HandCondition::kStopped; }));
  EXPECT_FALSE(telemetry.why_not.empty());
  ASSERT_TRUE(run_until(rig, HandAction::kHold, [&] { return telemetry.condition == HandCondition::kReady; }));
  // A restart is noticed where the hand has been moved from zero.
  ASSERT_TRUE(run_until(rig, HandAction::kMove, [&] { return rig.simulator.motor_counts()[2] > 40.0; }));
  ASSERT_TRUE(rig.simulator.fault("reboot").ok());
  static_cast<void>(run_until(rig, HandAction::kHold, [&] { return !rig.hand->reason().empty(); }));
  const auto connected = rig.hand->connect();
  ASSERT_TRUE(connected) << connected.error().detail.c_str();
  rig.info = *connected;
  ASSERT_TRUE(run_until(rig, HandAction::kHold, [&] { return telemetry.condition == HandCondition::kRestarted; }))
      << rig.hand->reason();
  EXPECT_NE(telemetry.why_not.view().find("calibrate"), std::string_view::npos);
  EXPECT_EQ(rig.hand->counters().restarts, 1U);
}

TEST(MiaReadings, ThatAreMissingOrOldAreNotTold) {
  mia::TelemetryConfig config;
  mia::TelemetryReader reader(config);
  reader.begin();
  const TimePoint now = transport::now();
  EXPECT_TRUE(reader.silent(now));
  HandTelemetry telemetry;
  reader.tell(now, telemetry);
  EXPECT_EQ(telemetry.t_current, TimePoint{});
  EXPECT_EQ(telemetry.t_force, TimePoint{});
  ASSERT_TRUE(reader.take(mia::encode_triple(mia::TripleLine::kCurrent, {1, 2, 3}).view(), now));
  ASSERT_TRUE(reader.take(mia::encode_strain_gauges({10, 20, 30, 40, 50, 60, 0, 0}).view(), now));
  EXPECT_FALSE(reader.silent(now));
  EXPECT_TRUE(reader.silent(now + milliseconds(1)));
  reader.tell(now + mia::TelemetryReader::kFresh, telemetry);
  EXPECT_EQ(telemetry.t_current, now);
  EXPECT_EQ(telemetry.current_raw[2], 3);
  EXPECT_EQ(telemetry.force[2].tangential, 10) << "the first gauge of the line";
  reader.tell(now + mia::TelemetryReader::kFresh + milliseconds(1), telemetry);
  EXPECT_EQ(telemetry.t_current, TimePoint{}) << "too old to be shown";
  config.every_cycles = 0;
  EXPECT_FALSE(mia::TelemetryReader(config).silent(now)) << "not asked for";
}

TEST(MiaCalibration, InterruptedTellsTheHandToStopAndSaysSo) {
  MiaRig rig;
  int asked = 0;
  const std::uint64_t stops = rig.hand->counters().stops;
  const Status ended = rig.hand->calibrate([&asked] { return ++asked > 2; });
  ASSERT_FALSE(ended);
  EXPECT_NE(ended.error().detail.view().find("told to stop"), std::string_view::npos) << ended.error().detail.c_str();
  EXPECT_EQ(rig.hand->counters().stops, stops + 1);
  EXPECT_EQ(rig.hand->read(rig.state), IoStatus::kDisconnected);
}

}  // namespace
}  // namespace embody::test
