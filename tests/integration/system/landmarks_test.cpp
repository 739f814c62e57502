// The second sensor: one line of the configuration, and the same robot follows a landmark tracker.
#include <cmath>
#include <csignal>

#include "daemon/control/exit_code.hpp"
#include "drivers/landmarks/landmark_tracker.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/transport/udp.hpp"
#include "tests/integration/system/rig.hpp"

namespace embody::test {
namespace {

using control::Command;

std::uint16_t free_udp_port() {
  const auto socket = transport::udp_bind("127.0.0.1", 0, 4096);
  return socket ? transport::local_port(socket->get()) : std::uint16_t{0};
}

/// Lab and daemon with `[tracker] driver = "landmarks"`; nobody sends yet.
void start_with_landmarks(Rig& rig, std::uint16_t port) {
  std::string config = rig.folder.read("embody.toml");
  const std::string table = "[tracker]\n";
  config.insert(config.find(table) + table.size(), "driver = \"landmarks\"\n");
  config += "[tracker.landmarks]\nport = " + std::to_string(port) + "\n";
  rig.folder.write("embody.toml", config);
  rig.start_daemon();
}

ctl::ChildProcess sender(Rig& rig, std::uint16_t port, std::vector<std::string> more) {
  std::vector<std::string> arguments{"landmarks", "--port", std::to_string(port)};
  arguments.insert(arguments.end(), more.begin(), more.end());
  auto child = ctl::ChildProcess::start(EMBODY_BINARY_DIR "/embody-sim", arguments, rig.folder.file("landmarks.log"));
  EXPECT_TRUE(child.ok()) << child.error().detail.view();
  return std::move(*child);
}

bool connected(const json& status) {
  for (const auto& device : status["devices"]) {
    if (device["state"] != "connected") return false;
  }
  return status["mode"]["name"] != "offline";
}

TEST(Landmarks, MoveTheRobotAfterOneLineOfConfiguration) {
  const std::uint16_t port = free_udp_port();
  Rig rig({.start_daemon = false});
  start_with_landmarks(rig, port);
  ASSERT_TRUE(rig.until(connected)) << rig.status().dump(2);
  const json before = rig.report();
  ctl::ChildProcess sent = sender(rig, port, {"--rate", "60", "--loop"});
  ASSERT_TRUE(rig.engage()) << rig.status().dump(2);
  EXPECT_TRUE(rig.until([](const json& s) { return s["counters"]["frames_used"] > 300; }, 20));

  const json status = rig.status();
  EXPECT_EQ(status["mode"]["name"], "engaged") << status["mode"].dump();
  EXPECT_LT(status["tracking"]["arm_error_mm"], 60.0);
  EXPECT_EQ(status["counters"]["poses_invalid"], 0);
  EXPECT_EQ(status["counters"]["rt_heap_allocations"], 0);
  EXPECT_GT(status["counters"]["finger_frames"], 200);
  EXPECT_EQ(status["devices"]["tracker"]["counters"]["malformed"], 0);
  EXPECT_EQ(status["devices"]["tracker"]["counters"]["duplicates"], 0);
  EXPECT_NEAR(status["landmarks"]["palm_scale"].get<double>(), 1.0, 0.02);
  for (const char* finger : kFingerNames) {
    EXPECT_LT(status["marker_residual_mm"][finger], 6.0) << finger;
    EXPECT_GT(status["marker_residual_mm"][finger], 0.0) << finger;
  }
  const json after = rig.report();
  double moved_rad = 0.0;
  for (std::size_t i = 0; i < 6; ++i) {
    moved_rad = std::max(
        moved_rad, std::abs(after["arm_now"]["q_rad"][i].get<double>() - before["arm_now"]["q_rad"][i].get<double>()));
  }
  EXPECT_GT(moved_rad, 0.02) << "the arm follows";
  EXPECT_GT(after["mia"]["motions"], before["mia"]["motions"]) << "the hand follows";

  sent.signal(SIGTERM);
  EXPECT_TRUE(rig.until_mode("stopped")) << "a silent tracker stops the robot";
}

TEST(Landmarks, GarbageIsCountedAndTheSessionGoesOn) {
  const std::uint16_t port = free_udp_port();
  Rig rig({.start_daemon = false});
  start_with_landmarks(rig, port);
  ASSERT_TRUE(rig.until(connected));
  const auto socket = transport::udp_connect("127.0.0.1", port);
  ASSERT_TRUE(socket.ok());
  std::array<std::byte, landmarks::kDatagramSize> junk{};
  for (int i = 0; i < 10; ++i) {
    junk[0] = static_cast<std::byte>(i);
    ASSERT_EQ(transport::send_message(socket->get(), std::span(junk).first(i % 2 == 0 ? junk.size() : 7)),
              IoStatus::kDone);
  }
  EXPECT_TRUE(rig.until([](const json& s) { return s["devices"]["tracker"]["counters"]["malformed"] == 10; }));
  ctl::ChildProcess sent = sender(rig, port, {"--loop"});
  EXPECT_TRUE(rig.until([](const json& s) { return s["counters"]["frames_used"] > 10; }));
  const json status = rig.status();
  EXPECT_EQ(status["devices"]["tracker"]["sessions"], 1);
  EXPECT_EQ(status["devices"]["tracker"]["counters"]["malformed"], 10);
  sent.signal(SIGTERM);
  sent.wait(TimePoint::max());
}

TEST(Landmarks, TheSenderEndsByItselfAndSaysWhatItSent) {
  const Finished sent = run_program(
      "embody-sim", {"landmarks", "--rate", "1000", "--duration", "1", "--port", std::to_string(free_udp_port())});
  EXPECT_EQ(sent.exit_code, 0) << sent.errors;
  EXPECT_NE(sent.output.find("\"sent\":1000"), std::string::npos) << sent.output;
}

TEST(Landmarks, TheSenderRefusesNumbersThatAreNone) {
  for (const char* option : {"--rate", "--duration"}) {
    for (const char* value : {"nan", "inf", "-1", "x"}) {
      const Finished refused = run_program("embody-sim", {"landmarks", option, value});
      EXPECT_EQ(refused.exit_code, kExitUsage) << option << " " << value << ": " << refused.errors;
    }
  }
}

TEST(Landmarks, ATableThatIsWrongIsNamedWithItsLine) {
  const TemporaryFolder folder;
  folder.write("wrong.csv", "frame,wrist_x_m\n0,1\n");
  const Finished sent = run_program("embody-sim", {"landmarks", folder.file("wrong.csv")});
  EXPECT_EQ(sent.exit_code, kExitFailed);
  EXPECT_NE(sent.errors.find("wrong.csv:1: there is no column wrist_y_m"), std::string::npos) << sent.errors;
}

}  // namespace
}  // namespace embody::test
