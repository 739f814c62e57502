// embodyctl capture against simulated devices: what is in the file, what reaches the device, exit codes.
#include <signal.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <fstream>

#include "daemon/app/config_io.hpp"
#include "daemon/app/devices.hpp"
#include "daemon/control/exit_code.hpp"
#include "daemon/ctl/capture_can.hpp"
#include "daemon/ctl/capture_link.hpp"
#include "daemon/ctl/command.hpp"
#include "drivers/capture/can_listener.hpp"
#include "drivers/landmarks/codec.hpp"
#include "drivers/sim/mia/mia_simulator.hpp"
#include "drivers/sim/qtm/qtm_server.hpp"
#include "drivers/sim/ur/ur_controller.hpp"
#include "drivers/transport/can_double.hpp"
#include "drivers/transport/udp.hpp"
#include "drivers/ur_rtde/dashboard.hpp"
#include "tests/unit/capture/support.hpp"

namespace embody::ctl {
namespace {

using capture::Event;
using test::eventually;

/// Ctrl-C must reach the command only, whatever threads the simulators have.
[[maybe_unused]] const bool signals_blocked = [] {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  return pthread_sigmask(SIG_BLOCK, &set, nullptr) == 0;
}();

const std::string kShipped = std::string(EMBODY_SOURCE_DIR) + "/config/";

class CaptureCommand : public testing::Test {
 protected:
  /// A configuration of the shipped glove and hand with these lines.
  std::string configure(const std::string& tracker, const std::string& arm, const std::string& hand) {
    const std::string path = folder / "embody.toml";
    std::ofstream(path) << "schema = 1\n[tracker]\n"
                        << tracker << "\n[glove]\nfile = \"" << kShipped << "gloves/paper13.toml\"\n[arm]\n"
                        << arm << "\n[hand]\nfile = \"" << kShipped << "hands/mia.toml\"\n"
                        << hand << "\n";
    return path;
  }
  static std::string at(int port) { return "host = \"127.0.0.1\"\nport = " + std::to_string(port); }

  /// embodyctl capture ARGUMENTS; what it prints is kept.
  int run(std::vector<std::string> arguments) {
    int exit_code = -1;
    CLI::App app;
    app.set_version_flag("--version", "embodyctl 9.9");
    add_capture_command(app, exit_code);
    std::reverse(arguments.begin(), arguments.end());
    arguments.push_back("capture");
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    try {
      app.parse(arguments);
    } catch (const CLI::ParseError&) {
      exit_code = kExitUsage;
    }
    out = testing::internal::GetCapturedStdout();
    err = testing::internal::GetCapturedStderr();
    return exit_code;
  }
  capture::Capture load() {
    auto loaded = capture::load_capture(output);
    EXPECT_TRUE(loaded.ok()) << loaded.error().detail.view();
    return loaded ? std::move(*loaded) : capture::Capture{};
  }

  test::TemporaryFolder folder;
  std::string output = folder / "link.jsonl";
  std::string out, err;
};

sim::Motion still_markers(const std::vector<std::string>& names) {
  sim::Motion motion;
  motion.rate_hz = 100.0;
  motion.marker_names = names;
  motion.generate = [](std::size_t, std::span<Marker> markers) {
    for (std::size_t i = 0; i < markers.size(); ++i) {
      markers[i].p_W = {0.01 * static_cast<double>(i), 0.0, 0.1};
      markers[i].visible = true;
    }
  };
  motion.source = "still";
  return motion;
}

std::string text(const test::Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST_F(CaptureCommand, TrackerReadsFramesAndKeepsBothConnections) {
  const auto glove = config::load_config(configure("", "", ""));
  ASSERT_TRUE(glove.ok()) << glove.error().detail.view();
  sim::QtmServer qtm({}, still_markers(glove->glove.names));
  ASSERT_TRUE(qtm.start().ok());
  qtm.play();
  const std::string config = configure(at(qtm.port()), "", "");
  ASSERT_EQ(run({"tracker", "--config", config, "--duration", "1.6", "-o", output}), kExitOk) << err;
  EXPECT_NE(out.find("     1 s: "), std::string::npos) << out;
  EXPECT_NE(out.find("2 connections"), std::string::npos) << out;
  const auto capture = load();
  EXPECT_EQ(capture.header.link, capture::LinkKind::kQtm);
  EXPECT_EQ(capture.header.peer, "127.0.0.1:" + std::to_string(qtm.port()));
  EXPECT_EQ(capture.header.program, "embodyctl 9.9");
  std::string sent;
  for (std::uint32_t c = 1; c <= 2; ++c) sent += text(test::bytes_of(capture, c, Event::kOut));
  EXPECT_NE(sent.find("StreamFrames"), std::string::npos);
  EXPECT_EQ(sent.find("TakeControl"), std::string::npos);
  EXPECT_GT(test::bytes_of(capture, 1, Event::kIn).size() + test::bytes_of(capture, 2, Event::kIn).size(), 10'000u);
}

TEST_F(CaptureCommand, ArmGetsNoCommandAndNoProgram) {
  sim::UrControllerConfig simulated;
  simulated.robot.program_text.clear();  // a daemon would load one
  sim::UrController controller(simulated);
  ASSERT_TRUE(controller.start().ok());
  const Vector6 q_rad = simulated.robot.q_start_rad;
  const std::string config =
      configure("", at(controller.port()) + "\n[arm.program]\nport = " + std::to_string(controller.primary_port()), "");
  ASSERT_EQ(run({"arm", "--config", config, "--duration", "1.2", "-o", output}), kExitOk) << err;
  const auto capture = load();
  EXPECT_EQ(capture.header.link, capture::LinkKind::kRtde);
  const auto opened = std::count_if(capture.chunks.begin(), capture.chunks.end(),
                                    [](const auto& chunk) { return chunk.event == Event::kOpen; });
  EXPECT_EQ(opened, 1);  // none to the primary port
  EXPECT_GT(test::bytes_of(capture, 1, Event::kIn).size(), 20'000u);
  EXPECT_LT(test::bytes_of(capture, 1, Event::kOut).size(), 3'000u);  // the handshake and one package of mode 0
  EXPECT_EQ(controller.latest().q_rad, q_rad);
}

TEST_F(CaptureCommand, HandIsAskedForPositionsAndDoesNotMove) {
  sim::MiaSimulator simulator({});
  ASSERT_TRUE(simulator.start().ok());
  const std::string config = configure("", "", "device = \"" + simulator.device() + "\"");
  ASSERT_EQ(run({"hand", "--config", config, "--duration", "1.2", "-o", output}), kExitOk) << err;
  EXPECT_EQ(simulator.counters().motions, 0u);
  EXPECT_GT(simulator.counters().reads, 10u);
  const auto capture = load();
  EXPECT_EQ(capture.header.link, capture::LinkKind::kSerial);
  EXPECT_EQ(capture.header.peer, simulator.device());
  EXPECT_GT(test::bytes_of(capture, 1, Event::kIn).size(), 300u);
}

/// Another program's frames on a bus of our own: the listener is the only one there.
class BusBeside {
 public:
  explicit BusBeside(const std::string& path) : listener_(std::move(*transport::double_listen(path))) {}
  /// Waits for the listener and sends `frames`; what came from it until `done`.
  std::size_t play(const std::vector<transport::CanFrame>& frames, const std::function<bool()>& done) {
    transport::UniqueFd fd;
    EXPECT_TRUE(eventually([&] { return static_cast<bool>(fd = transport::double_accept(listener_.get())); }));
    transport::CanBus bus(std::move(fd), "bus", {frames.front().id});
    for (const auto& frame : frames) EXPECT_EQ(bus.send(frame), IoStatus::kDone);
    EXPECT_TRUE(eventually(done));
    transport::CanFrame heard;
    return (bus.receive(heard) == IoStatus::kEmpty ? 0 : 1) + bus.counters().ignored;
  }

 private:
  transport::UniqueFd listener_;
};

TEST_F(CaptureCommand, AHandOnCanIsListenedToAndNothingIsSent) {
  const std::string bus_path = folder / "bus";
  const std::string config =
      configure("", "", "[hand.mia]\nwire = \"can_segments\"\ncan_interface = \"unix:" + bus_path + "\"");
  BusBeside bus(bus_path);
  std::size_t sent_by_us = 1;
  const auto recorded = [this] {  // header, open line and both frames: then Ctrl-C
    std::ifstream file(output);
    return std::count(std::istreambuf_iterator<char>(file), {}, '\n') >= 4 && ::kill(::getpid(), SIGINT) == 0;
  };
  std::thread others([&] {
    sent_by_us = bus.play({{{0x340}, 2, {1, 2}, {}}, {{0x7ff}, 1, {9}, {}}, {{0x341}, 1, {3}, {}}}, recorded);
  });
  const int exit_code = run({"hand", "--config", config, "-o", output});
  others.join();
  EXPECT_TRUE(exit_code == kExitOk || exit_code == kExitUnavailable) << err;  // the others' end goes with them
  EXPECT_EQ(sent_by_us, 0u);
  EXPECT_NE(out.find("(can_segments, 0x340 to the hand, 0x341 from it) and sends nothing"), std::string::npos) << out;
  const auto capture = load();
  EXPECT_EQ(capture.header.link, capture::LinkKind::kCan);
  std::vector<capture::Chunk> frames;
  std::copy_if(capture.chunks.begin(), capture.chunks.end(), std::back_inserter(frames),
               [](const auto& chunk) { return chunk.event == Event::kIn || chunk.event == Event::kOut; });
  ASSERT_EQ(frames.size(), 2u) << "0x7ff is not the hand's";
  EXPECT_EQ(frames[0].event, Event::kOut);
  EXPECT_EQ(frames[0].bytes, capture::bytes_of({{0x340}, 2, {1, 2}, {}}));
  EXPECT_EQ(frames[1].event, Event::kIn);
  EXPECT_EQ(frames[1].bytes, capture::bytes_of({{0x341}, 1, {3}, {}}));
}

TEST_F(CaptureCommand, ASilentBusAndOneThatEndsAreToldInOneSentence) {
  const std::string bus_path = folder / "bus";
  const std::string config =
      configure("", "", "[hand.mia]\nwire = \"can_compact\"\ncan_interface = \"unix:" + bus_path + "\"");
  const auto expect_unavailable = [&](const char* duration_s, const char* part) {
    EXPECT_EQ(run({"hand", "--config", config, "--duration", duration_s, "--force", "-o", output}), kExitUnavailable);
    EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
    EXPECT_NE(err.find(part), std::string::npos) << err;
  };
  expect_unavailable("1", "no simulated CAN bus");
  auto listener = transport::double_listen(bus_path);
  ASSERT_TRUE(listener.ok());
  expect_unavailable("0.2", "no frame of the hand came by");
  listener->reset();
  BusBeside bus(bus_path);
  std::thread others([&] { bus.play({{{0x210}, 1, {1}, {}}}, [] { return true; }); });
  expect_unavailable("60", "has gone");
  others.join();
}

TEST(CaptureCan, TheIdentifiersAreTheProfilesOwnByWhoSendsThem) {
  config::MiaHandConfig mia;
  mia.can_extended_ids = true;
  mia.wire = config::MiaWire::kCanIsoTp;
  EXPECT_EQ(can_hand_ids(mia).host, (std::vector<transport::CanId>{{0x340, true}}));
  EXPECT_EQ(can_hand_ids(mia).hand, (std::vector<transport::CanId>{{0x341, true}}));
  mia.wire = config::MiaWire::kCanCompact;
  mia.can_base_id = 0x1fffffe0;
  const auto ids = can_hand_ids(mia);
  EXPECT_EQ(ids.host.size(), 5u) << "a command to each motor and to all, and the heartbeat";
  EXPECT_EQ(ids.host.size() + ids.hand.size(), transport::kMaxCanFilters);
  for (const auto id : ids.hand) {
    EXPECT_TRUE(id.valid());
    EXPECT_EQ(std::count(ids.host.begin(), ids.host.end(), id), 0);
  }
}

TEST_F(CaptureCommand, ProxyPrintsWhatToConfigureAndConnectsNothing) {
  sim::UrController controller({});
  ASSERT_TRUE(controller.start().ok());
  const std::string config = configure("", at(controller.port()), "");
  ASSERT_EQ(run({"arm", "--proxy", "--config", config, "--duration", "0.3", "-o", output}), kExitOk) << err;
  EXPECT_NE(out.find("[arm]\nhost = \"127.0.0.1\"\nport = "), std::string::npos) << out;
  EXPECT_NE(out.find("\ndashboard_port = "), std::string::npos) << out;
  EXPECT_NE(out.find("[arm.program]\nport = "), std::string::npos) << out;
  EXPECT_TRUE(load().chunks.empty());
}

TEST_F(CaptureCommand, AWholeRunOfADriverPassesTheProxyWithItsProgram) {
  sim::UrControllerConfig simulated;
  simulated.robot.program_text.clear();
  sim::UrController controller(simulated);
  ASSERT_TRUE(controller.start().ok());
  auto config = config::load_config(
      configure("",
                at(controller.port()) + "\ndashboard_port = " + std::to_string(controller.dashboard_port()) +
                    "\n[arm.program]\nport = " + std::to_string(controller.primary_port()),
                ""));
  ASSERT_TRUE(config.ok()) << config.error().detail.view();
  test::Recording recording(capture::LinkKind::kRtde);
  const auto link = open_capture_link(CapturedDevice::kArm, *config, *recording.writer);
  ASSERT_TRUE(link.ok());
  const auto arm = make_arm(config->arm);
  ASSERT_TRUE(arm->connect().ok());
  ArmState state;
  EXPECT_TRUE(eventually([&] {
    static_cast<void>(arm->service());
    while (arm->read(state) == IoStatus::kDone) {
    }
    return state.condition == ArmCondition::kReady || state.condition == ArmCondition::kProgramStopped;
  }));
  EXPECT_TRUE(eventually([&] {
    static_cast<void>(arm->service());
    while (arm->read(state) == IoStatus::kDone) {
    }
    return recording.writer->counters().connections >= 2;
  }));
  ur::DashboardConfig dashboard;
  dashboard.host = config->arm.host;
  dashboard.port = static_cast<std::uint16_t>(config->arm.dashboard_port);
  const auto mode = ur::Dashboard(dashboard).robot_mode();
  EXPECT_TRUE(mode.ok()) << mode.error().detail.view();
  const auto capture = recording.finish();
  EXPECT_EQ(capture.chunks.front().port, controller.port());
  const bool asked = std::any_of(capture.chunks.begin(), capture.chunks.end(), [&](const auto& chunk) {
    return chunk.event == Event::kOut && text(chunk.bytes) == "robotmode\n";
  });
  EXPECT_TRUE(asked) << "the dashboard's text is in the file";
  const bool primary = std::any_of(capture.chunks.begin(), capture.chunks.end(), [&](const auto& chunk) {
    return chunk.event == Event::kOpen && chunk.port == controller.primary_port();
  });
  EXPECT_TRUE(primary);
}

TEST_F(CaptureCommand, LandmarksPassTheForwarder) {
  auto socket = transport::udp_bind("127.0.0.1", 0, 4096);
  ASSERT_TRUE(socket.ok());
  const std::uint16_t port = transport::local_port(socket->get());
  socket->reset();
  auto config = config::load_config(
      configure("driver = \"landmarks\"\n[tracker.landmarks]\nport = " + std::to_string(port), "", ""));
  ASSERT_TRUE(config.ok()) << config.error().detail.view();
  test::Recording recording(capture::LinkKind::kUdp);
  EXPECT_EQ(link_header(CapturedDevice::kTracker, *config).link, capture::LinkKind::kUdp);
  const auto link = open_capture_link(CapturedDevice::kTracker, *config, *recording.writer);
  ASSERT_TRUE(link.ok()) << link.error().detail.view();
  const auto tracker = make_tracker(*config);
  ASSERT_TRUE(tracker->connect().ok());
  landmarks::LandmarkFrame datagram;
  datagram.frame_number = 7;
  const auto sensor = transport::udp_connect("127.0.0.1", port);
  ASSERT_EQ(transport::send_message(sensor->get(), landmarks::encode(datagram)), IoStatus::kDone);
  MarkerFrame frame;
  EXPECT_TRUE(eventually([&] { return tracker->read(frame) == IoStatus::kDone; }));
  EXPECT_EQ(frame.frame_number, 7u);
  const auto capture = recording.finish();
  ASSERT_EQ(capture.chunks.size(), 2u);
  EXPECT_EQ(capture.chunks[1].bytes.size(), 360u);
}

TEST_F(CaptureCommand, EachFailureIsOneSentenceAndItsExitCode) {
  const auto one_sentence = [this](const char* part) {
    EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
    EXPECT_NE(err.find(part), std::string::npos) << err;
  };
  const auto closed = transport::tcp_listen("127.0.0.1", 0);
  const int port = transport::local_port(closed->get()) - 1;  // nobody listens, most likely
  const std::string config = configure(at(port), at(port), "device = \"/dev/no-such-line\"");
  EXPECT_EQ(run({"hand", "--config", config, "--duration", "1", "-o", output}), kExitUnavailable);
  one_sentence("/dev/no-such-line");
  EXPECT_FALSE(std::filesystem::exists(output));
  EXPECT_EQ(run({"arm", "--config", config, "--duration", "1", "-o", output}), kExitUnavailable);
  EXPECT_EQ(run({"arm", "--config", config, "--duration", "1", "-o", output}), kExitFailed);
  one_sentence("exists");
  EXPECT_EQ(run({"arm", "--config", config, "--duration", "1", "-o", "/dev/full"}), kExitFailed);
  one_sentence("No space left");
  EXPECT_EQ(run({"arm", "--config", folder / "none.toml", "-o", output}), kExitConfiguration);
  one_sentence("none.toml");
  EXPECT_EQ(run({"arm", "--config", config, "--duration", "0", "-o", output}), kExitUsage);
  EXPECT_EQ(run({"arm", "--config", config}), kExitUsage);
  EXPECT_EQ(run({"legs", "-o", output}), kExitUsage);
  const std::string by_dds = configure("", "", "driver = \"joint_state\"\n[dds]\nenabled = true");
  EXPECT_EQ(run({"hand", "--config", by_dds, "--force", "-o", output}), kExitFailed);
  one_sentence("joint_state");
}

TEST_F(CaptureCommand, CtrlCEndsItAndTheFileIsWhole) {
  sim::MiaSimulator simulator({});
  ASSERT_TRUE(simulator.start().ok());
  const std::string config = configure("", "", "device = \"" + simulator.device() + "\"");
  for (const bool with_duration : {false, true}) {
    const auto reads = simulator.counters().reads;
    std::thread operator_hand([&] {
      EXPECT_TRUE(eventually([&] { return simulator.counters().reads > reads + 3; }));
      ::kill(::getpid(), SIGINT);
    });
    std::vector<std::string> arguments{"hand", "--force", "--config", config, "-o", output};
    if (with_duration) arguments.insert(arguments.end(), {"--duration", "60"});
    EXPECT_EQ(run(arguments), with_duration ? kExitInterrupted : kExitOk) << err;
    operator_hand.join();
    EXPECT_FALSE(load().chunks.empty());
  }
}

TEST_F(CaptureCommand, AHandThatIsUnpluggedEndsTheCaptureAndTheFileIsWhole) {
  sim::MiaSimulator simulator({});
  ASSERT_TRUE(simulator.start().ok());
  const std::string config = configure("", "", "device = \"" + simulator.device() + "\"");
  std::thread operator_hand([&] {
    EXPECT_TRUE(eventually([&] { return simulator.counters().reads > 5; }));
    simulator.unplug();
  });
  EXPECT_EQ(run({"hand", "--config", config, "--duration", "60", "-o", output}), kExitUnavailable) << err;
  operator_hand.join();
  EXPECT_EQ(load().chunks.back().event, Event::kClose);
}

}  // namespace
}  // namespace embody::ctl
