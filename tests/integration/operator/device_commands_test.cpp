// `embodyctl arm`, `embodyctl hand` and `embodyctl discover` as people and programs call them, against simulated
// devices.
#include <csignal>

#include "daemon/control/exit_code.hpp"
#include "daemon/ctl/child_process.hpp"
#include "drivers/sim/mia/mia_simulator.hpp"
#include "drivers/sim/robotiq/robotiq_simulator.hpp"
#include "drivers/sim/ur/ur_controller.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/transport/tty.hpp"
#include "tests/integration/system/rig.hpp"

namespace embody::test {
namespace {

using std::chrono::milliseconds;

/// A robot that is switched off, with quick brakes, and a configuration that names its dashboard.
struct ArmLab {
  explicit ArmLab(bool remote) : controller(config_of(remote)) {
    EXPECT_TRUE(controller.start().ok());
    folder.write("embody.toml", "schema = 1\n[arm]\ndashboard_port = " + std::to_string(controller.dashboard_port()) +
                                    "\n[hand]\nfile = \"" EMBODY_SOURCE_DIR "/config/hands/mia.toml\"\n");
  }
  static sim::UrControllerConfig config_of(bool remote) {
    sim::UrControllerConfig config;
    config.powered = false;
    config.remote = remote;
    config.times.boot = config.times.power = config.times.brakes = milliseconds(100);
    return config;
  }
  Finished arm(const std::string& action) {
    return run_program("embodyctl", {"arm", action, "--config", folder.file("embody.toml"), "--json"}, 60);
  }
  json status() { return json::parse(arm("status").output, nullptr, false); }

  TemporaryFolder folder;
  sim::UrController controller;
};

TEST(ArmCommand, BringsTheRobotUpAndShowsItsModes) {
  ArmLab lab(true);
  EXPECT_EQ(lab.status()["robot_mode"], "power off");
  const Finished up = lab.arm("bring-up");
  EXPECT_EQ(up.exit_code, kExitOk) << up.output << up.errors;
  const json running = lab.status();
  EXPECT_EQ(running["robot_mode"], "running");
  EXPECT_EQ(running["safety"], "normal");
  EXPECT_EQ(running["remote_control"], true);
  EXPECT_EQ(lab.arm("power-off").exit_code, kExitOk);
}

TEST(ArmCommand, IsRefusedInLocalControlAndForStopsThatAreTooFresh) {
  ArmLab local(false);
  const Finished refused = local.arm("power-on");
  EXPECT_EQ(refused.exit_code, kExitRefused) << refused.output;
  EXPECT_NE(refused.output.find("emote"), std::string::npos) << refused.output;

  ArmLab lab(true);
  ASSERT_EQ(lab.arm("bring-up").exit_code, kExitOk);
  lab.controller.protective_stop();
  const Finished early = lab.arm("unlock");
  EXPECT_EQ(early.exit_code, kExitRefused) << early.output;
  EXPECT_EQ(lab.status()["safety"], "protective stop") << "nothing is unlocked by itself";
}

TEST(ArmCommand, SaysThatNobodyAnswers) {
  ArmLab lab(true);
  lab.controller.stop();
  const Finished gone = lab.arm("status");
  EXPECT_EQ(gone.exit_code, kExitUnavailable) << gone.output << gone.errors;
  EXPECT_FALSE(json::parse(gone.output, nullptr, false)["error"]["message"].get<std::string>().empty());
}

/// A hand on a pseudo-terminal and a configuration that names it.
std::string hand_config(const TemporaryFolder& folder, const std::string& file, const std::string& device,
                        const std::string& driver) {
  folder.write("embody.toml", "schema = 1\n[hand]\nfile = \"" EMBODY_SOURCE_DIR "/config/hands/" + file +
                                  "\"\ndriver = \"" + driver + "\"\ndevice = \"" + device + "\"\n");
  return folder.file("embody.toml");
}

Finished hand(const std::string& action, const std::string& config) {
  return run_program("embodyctl", {"hand", action, "--config", config, "--json"}, 60);
}

TEST(HandCommand, ActivatesARobotiqAndNothingElseDoes) {
  sim::RobotiqSimulator simulator({});
  ASSERT_TRUE(simulator.start().ok());
  const TemporaryFolder folder;
  const std::string config = hand_config(folder, "robotiq_2f140.toml", simulator.device(), "robotiq");
  EXPECT_EQ(hand("calibrate", config).exit_code, kExitFailed) << "that is for a Mia";
  EXPECT_EQ(simulator.travelled_counts(), 0.0);
  const Finished activated = hand("activate", config);
  EXPECT_EQ(activated.exit_code, kExitOk) << activated.output << activated.errors;
  EXPECT_GT(simulator.travelled_counts(), 100.0) << "the fingers opened and closed";
}

TEST(HandCommand, CalibratesAMiaAndSaysWhenTheDeviceHasAnOwner) {
  sim::MiaSimulator simulator({});
  ASSERT_TRUE(simulator.start().ok());
  const TemporaryFolder folder;
  const std::string config = hand_config(folder, "mia.toml", simulator.device(), "mia");
  {
    const auto owner = transport::open_tty(simulator.device());
    ASSERT_TRUE(owner.ok());
    EXPECT_EQ(hand("calibrate", config).exit_code, kExitRefused);
  }
  const Finished calibrated = hand("calibrate", config);
  EXPECT_EQ(calibrated.exit_code, kExitOk) << calibrated.output << calibrated.errors;
}

TEST(HandCommand, ShowsAndTaresBothKindsOfMiaAndMovesNothing) {
  for (const bool older : {false, true}) {
    SCOPED_TRACE(older ? "streaming" : "acknowledging");
    sim::MiaSimulator simulator(older ? sim::older_mia() : sim::MiaSimulatorConfig{});
    ASSERT_TRUE(simulator.start().ok());
    const TemporaryFolder folder;
    const std::string config = hand_config(folder, "mia.toml", simulator.device(), "mia");
    const Finished shown = hand("show", config);
    ASSERT_EQ(shown.exit_code, kExitOk) << shown.output << shown.errors;
    const json result = json::parse(shown.output, nullptr, false)["result"];
    EXPECT_EQ(result["condition"], "ready") << shown.output;
    EXPECT_EQ(result["position_rad"].size(), 3U);
    EXPECT_EQ(result["current_raw"].size(), 3U);
    EXPECT_EQ(result["force_raw"].size(), 3U);
    const Finished tared = hand("tare", config);
    ASSERT_EQ(tared.exit_code, kExitOk) << tared.output << tared.errors;
    const json zero = json::parse(tared.output, nullptr, false)["result"];
    EXPECT_EQ(zero["strain_offset"].size(), 8U);
    EXPECT_NEAR(zero["zero_raw"]["middle"]["normal"].get<double>(), 260.0, 30.0) << "as the simulated hand idles";
    const Finished text = run_program("embodyctl", {"hand", "show", "--tare", "--config", config}, 60);
    EXPECT_EQ(text.exit_code, kExitOk) << text.errors;
    EXPECT_NE(text.output.find("forces"), std::string::npos) << text.output;
    EXPECT_EQ(simulator.counters().motions, 0U);
    EXPECT_EQ(simulator.counters().calibrations, 0U);
  }
}

TEST(HandCommand, ARobotiqShowsItsCurrentAndHasNoForces) {
  sim::RobotiqSimulator simulator({});
  ASSERT_TRUE(simulator.start().ok());
  const TemporaryFolder folder;
  const std::string config = hand_config(folder, "robotiq_2f140.toml", simulator.device(), "robotiq");
  const Finished shown = hand("show", config);
  ASSERT_EQ(shown.exit_code, kExitOk) << shown.output << shown.errors;
  const json result = json::parse(shown.output, nullptr, false)["result"];
  EXPECT_EQ(result["condition"], "not activated");
  EXPECT_EQ(result["current_a"].size(), 1U);
  EXPECT_FALSE(result.contains("force_raw"));
  const Finished tared = hand("tare", config);
  EXPECT_EQ(tared.exit_code, kExitFailed);
  EXPECT_NE(tared.output.find("forces"), std::string::npos) << tared.output;
  EXPECT_EQ(simulator.travelled_counts(), 0.0);
}

TEST(HandCommand, CtrlCWhileAMiaCalibratesTellsItToStop) {
  sim::MiaSimulator simulator({});
  ASSERT_TRUE(simulator.start().ok());
  const TemporaryFolder folder;
  const std::string config = hand_config(folder, "mia.toml", simulator.device(), "mia");
  auto child = ctl::ChildProcess::start(EMBODY_BINARY_DIR "/embodyctl", {"hand", "calibrate", "--config", config},
                                        folder.file("errors.txt"));
  ASSERT_TRUE(child.ok());
  const TimePoint deadline = transport::now() + std::chrono::seconds(20);
  while (simulator.counters().calibrations == 0 && transport::now() < deadline) {
    static_cast<void>(transport::wait_readable(-1, transport::now() + milliseconds(5)));
  }
  ASSERT_GE(simulator.counters().calibrations, 1U);
  child->signal(SIGINT);
  EXPECT_EQ(child->wait(deadline), kExitInterrupted);
  EXPECT_GE(simulator.counters().stops, 1U);
}

TEST(DiscoverCommand, AnswersWithAListAndTellsWhenItIsEmpty) {
  const Finished found = run_program("embodyctl", {"discover", "--seconds", "0.2", "--json"}, 30);
  const json list = json::parse(found.output, nullptr, false);
  ASSERT_TRUE(list.is_array()) << found.output << found.errors;
  EXPECT_EQ(found.exit_code, list.empty() ? kExitUnavailable : kExitOk);
  EXPECT_EQ(run_program("embodyctl", {"discover", "--seconds", "1000"}, 30).exit_code, kExitUsage);
}

}  // namespace
}  // namespace embody::test
