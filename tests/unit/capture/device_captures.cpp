#include "tests/unit/capture/device_captures.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <memory>

#include "drivers/capture/capture_writer.hpp"
#include "drivers/capture/pty_proxy.hpp"
#include "drivers/capture/tcp_proxy.hpp"
#include "drivers/mia/can_line.hpp"
#include "drivers/mia/compact/mia_can_hand.hpp"
#include "drivers/mia/mia_hand.hpp"
#include "drivers/qualisys/qualisys_tracker.hpp"
#include "drivers/sim/mia/can_simulator.hpp"
#include "drivers/sim/mia/mia_simulator.hpp"
#include "drivers/sim/qtm/qtm_server.hpp"
#include "drivers/sim/ur/ur_controller.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/ur_rtde/ur_rtde_arm.hpp"
#include "tests/unit/capture/can_tap.hpp"
#include "tests/unit/capture/support.hpp"

namespace embody::test {
namespace {

using capture::CaptureWriter;
using capture::LinkKind;

constexpr std::size_t kReadings = 24;
constexpr Duration kPatience = std::chrono::seconds(20);

std::unique_ptr<CaptureWriter> open_writer(const std::string& path, LinkKind link, const char* peer) {
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  capture::Header header;
  header.link = link;
  header.peer = peer;
  header.program = "test_capture_devices";
  auto writer = CaptureWriter::open(path, true, header);
  EXPECT_TRUE(writer.ok()) << writer.error().detail.view();
  return std::move(*writer);
}

/// Markers on circles of their own; the second is not seen in every fifth frame.
sim::Motion circles() {
  sim::Motion motion;
  motion.rate_hz = 100.0;
  motion.marker_names = captured_markers();
  motion.generate = [](std::size_t frame, std::span<Marker> markers) {
    for (std::size_t i = 0; i < markers.size(); ++i) {
      const double angle_rad = 0.1 * static_cast<double>(frame) + static_cast<double>(i);
      markers[i].p_W = {0.2 * std::cos(angle_rad), 0.2 * std::sin(angle_rad), 0.1 * static_cast<double>(i)};
      markers[i].visible = i != 1 || frame % 5 != 0;
    }
  };
  motion.source = "circles";
  return motion;
}

/// Reads until there are kReadings, stops the capture, and returns what had come; `act` sees the number of readings.
template <class Reading, class Driver, class Act>
std::size_t read_and_close(Driver& driver, int fd, CaptureWriter& writer, Act act) {
  const TimePoint deadline = transport::now() + kPatience;
  Reading reading;
  std::size_t count = 0;
  while (count < kReadings && transport::now() < deadline) {
    const IoStatus status = driver.read(reading);
    if (status == IoStatus::kDone) ++count;
    EXPECT_NE(status, IoStatus::kDisconnected) << driver.reason();
    if (status == IoStatus::kDisconnected) break;
    act(count);
    if (status == IoStatus::kEmpty) {
      static_cast<void>(transport::wait_readable(fd, transport::now() + std::chrono::milliseconds(1)));
    }
  }
  const Status closed = writer.close();
  EXPECT_TRUE(closed.ok()) << closed.error().detail.view();
  return count;
}

/// As read_and_close(), with kHold whenever the last position has come.
std::size_t hold_and_close(HandDriver& hand, int fd, CaptureWriter& writer) {
  std::size_t holds = 0;
  return read_and_close<HandDeviceState>(hand, fd, writer, [&](std::size_t replies) {
    if (holds > replies) return;
    HandCommand hold;
    hold.t_expires = transport::now() + kPatience;
    if (hand.write(hold, transport::now()) == IoStatus::kDone) ++holds;
  });
}

constexpr std::array<double, mia::kMotors> kStart_counts{30.0, -20.0, 100.0};

}  // namespace

const std::vector<std::string>& captured_markers() {
  static const std::vector<std::string> names{"hand_top", "hand_left", "hand_right", "thumb_tip"};
  return names;
}

std::size_t capture_tracker(const std::string& path) {
  sim::QtmServer qtm({}, circles());
  EXPECT_TRUE(qtm.start().ok());
  qtm.play();  // before the driver comes, so that no event waits for an upkeep that a replay does not call
  const auto writer = open_writer(path, LinkKind::kQtm, "simulated QTM");
  capture::TcpProxy proxy(*writer);
  EXPECT_TRUE(proxy.forward("127.0.0.1", qtm.port()).ok());
  proxy.start();
  qualisys::QualisysConfig config;
  config.port = proxy.port_for(qtm.port());
  config.backlog_limit = kPatience;
  qualisys::QualisysTracker tracker(config, captured_markers());
  const auto info = tracker.connect();
  EXPECT_TRUE(info.ok()) << info.error().detail.view();
  if (!info) return 0;
  return read_and_close<MarkerFrame>(tracker, info->fd, *writer, [](std::size_t) {});
}

std::size_t capture_arm(const std::string& path) {
  sim::UrControllerConfig simulated;
  simulated.frequency_hz = 500.0;
  sim::UrController controller(simulated);
  EXPECT_TRUE(controller.start().ok());
  const auto writer = open_writer(path, LinkKind::kRtde, "simulated UR controller");
  capture::TcpProxy proxy(*writer);
  EXPECT_TRUE(proxy.forward("127.0.0.1", controller.port()).ok());
  proxy.start();
  UrRtdeConfig config;
  config.port = proxy.port_for(controller.port());
  config.frequency_hz = kCapturedArmRate_hz;
  config.upload = false;
  config.stale_after = kPatience;
  UrRtdeArm arm(config);
  const auto info = arm.connect();
  EXPECT_TRUE(info.ok()) << info.error().detail.view();
  if (!info) return 0;
  return read_and_close<ArmState>(arm, info->fd, *writer, [](std::size_t) {});
}

std::size_t capture_hand(const std::string& path) {
  sim::MiaSimulatorConfig simulated;
  simulated.start_counts = kStart_counts;
  sim::MiaSimulator simulator(simulated);
  EXPECT_TRUE(simulator.start().ok());
  const auto writer = open_writer(path, LinkKind::kSerial, "simulated Mia hand");
  capture::PtyProxy proxy(*writer);
  const Status opened = proxy.open(simulator.device());
  EXPECT_TRUE(opened.ok()) << opened.error().detail.view();
  mia::MiaConfig config;
  config.device = proxy.device();
  config.telemetry.every_cycles = kSerialTelemetry_cycles;
  config.ack_timeout = std::chrono::milliseconds(500);
  mia::MiaHand hand(config);
  const auto info = hand.connect();
  EXPECT_TRUE(info.ok()) << info.error().detail.view();
  if (!info) return 0;
  return hold_and_close(hand, info->fd, *writer);
}

std::size_t capture_can_tunnel(const std::string& path) {
  const TemporaryFolder folder;
  sim::CanSimulatorConfig simulated;
  simulated.interface = "unix:" + folder / "hand";
  simulated.profile = sim::CanProfile::kTunnel;
  simulated.tunnel.framing = mia::CanFraming::kSegments;
  simulated.serial_hand.start_counts = kStart_counts;
  sim::MiaCanSimulator simulator(simulated);
  EXPECT_TRUE(simulator.start().ok());
  const auto writer = open_writer(path, LinkKind::kCan, "simulated Mia hand, serial protocol in segments");
  mia::CanTunnelConfig tunnel = simulated.tunnel;
  tunnel.interface = "unix:" + folder / "driver";
  const CanTap tap(tunnel.interface, simulated.interface, {tunnel.tx}, {tunnel.rx}, *writer);
  mia::MiaConfig config;
  config.device = tunnel.interface;
  config.telemetry.every_cycles = kTunnelTelemetry_cycles;
  config.ack_timeout = std::chrono::milliseconds(500);
  mia::MiaHand hand(config, mia::can_line(tunnel));
  const auto info = hand.connect();
  EXPECT_TRUE(info.ok()) << info.error().detail.view();
  return info ? hold_and_close(hand, info->fd, *writer) : 0;
}

std::size_t capture_can_compact(const std::string& path) {
  const TemporaryFolder folder;
  sim::CanSimulatorConfig simulated;
  simulated.interface = "unix:" + folder / "hand";
  simulated.compact_hand.start_counts = kStart_counts;
  sim::MiaCanSimulator simulator(simulated);
  EXPECT_TRUE(simulator.start().ok());
  const auto writer = open_writer(path, LinkKind::kCan, "simulated Mia hand, compact profile");
  mia::compact::CompactConfig config;
  config.interface = "unix:" + folder / "driver";
  config.ack_timeout = std::chrono::milliseconds(500);
  config.state_timeout = kPatience;
  std::vector<transport::CanId> host, device;
  for (std::uint32_t i = 0; i <= mia::compact::kLastId; ++i)
    (i <= mia::compact::kHeartbeatId ? host : device).push_back(config.ids.at(i));
  const CanTap tap(config.interface, simulated.interface, host, device, *writer);
  mia::compact::MiaCanHand hand(config);
  const auto info = hand.connect();
  EXPECT_TRUE(info.ok()) << info.error().detail.view();
  return info ? hold_and_close(hand, info->fd, *writer) : 0;
}

}  // namespace embody::test
