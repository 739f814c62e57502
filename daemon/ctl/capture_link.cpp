#include "daemon/ctl/capture_link.hpp"

#include "daemon/ctl/capture_can.hpp"
#include "drivers/capture/pty_proxy.hpp"
#include "drivers/capture/tcp_proxy.hpp"
#include "drivers/capture/udp_forwarder.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/transport/udp.hpp"

namespace embody::ctl {
namespace {

using capture::CaptureWriter;

const std::string kLoopback = "127.0.0.1";

std::string at(const std::string& host, int port) {
  return host + ":" + std::to_string(port);
}

/// The proxy's way of being captured: other addresses in the configuration.
std::string configure(const std::string& lines) {
  return "Captures what passes here; put this into the configuration of embodyd, then start it:\n\n" + lines + "\n";
}

/// `result` as a link, or its error.
template <class Link>
Result<std::unique_ptr<CaptureLink>> link_or_error(std::unique_ptr<Link> link, const Status& opened) {
  if (!opened) return opened.error();
  return std::unique_ptr<CaptureLink>(std::move(link));
}

/// Both TCP connections of the tracker. Frames over UDP would pass the proxy by: they are asked for over TCP.
class QtmLink final : public CaptureLink {
 public:
  explicit QtmLink(CaptureWriter& writer) : proxy_(writer) {}
  Status open(config::TrackerConfig& tracker) {
    const auto port = static_cast<std::uint16_t>(tracker.port);
    if (const Status added = proxy_.forward(tracker.host, port); !added) return added;
    port_ = proxy_.port_for(port);
    proxy_.start();
    tracker.host = kLoopback;
    tracker.port = port_;
    tracker.transport = config::Transport::kTcp;
    return {};
  }
  [[nodiscard]] std::string advice() const override {
    return configure("[tracker]\nhost = \"" + kLoopback + "\"\nport = " + std::to_string(port_) +
                     "\ntransport = \"tcp\"\n");
  }

 private:
  capture::TcpProxy proxy_;
  std::uint16_t port_{0};
};

/// The arm's real-time port, the one that takes the control program, and its dashboard.
class ArmLink final : public CaptureLink {
 public:
  explicit ArmLink(CaptureWriter& writer) : proxy_(writer) {}
  Status open(config::ArmConfig& arm) {
    for (int* port : {&arm.port, &arm.program.port, &arm.dashboard_port}) {
      const auto device_port = static_cast<std::uint16_t>(*port);
      if (const Status added = proxy_.forward(arm.host, device_port); !added) return added;
      *port = proxy_.port_for(device_port);
    }
    arm.host = kLoopback;
    port_ = arm.port;
    program_port_ = arm.program.port;
    dashboard_port_ = arm.dashboard_port;
    proxy_.start();
    return {};
  }
  [[nodiscard]] std::string advice() const override {
    return configure("[arm]\nhost = \"" + kLoopback + "\"\nport = " + std::to_string(port_) +
                     "\ndashboard_port = " + std::to_string(dashboard_port_) +
                     "\n[arm.program]\nport = " + std::to_string(program_port_) + "\n");
  }

 private:
  capture::TcpProxy proxy_;
  int port_{0};
  int program_port_{0};
  int dashboard_port_{0};
};

class SerialLink final : public CaptureLink {
 public:
  explicit SerialLink(CaptureWriter& writer) : proxy_(writer) {}
  Status open(config::HandConfig& hand) {
    if (const Status opened = proxy_.open(hand.device); !opened) return opened;
    hand.device = proxy_.device();
    return {};
  }
  [[nodiscard]] std::string advice() const override {
    return configure("[hand]\ndevice = \"" + proxy_.device() + "\"\n");
  }
  [[nodiscard]] Status status() const override {
    return proxy_.over() ? Status(make_error(Errc::kDisconnected, "the serial line is gone")) : Status();
  }

 private:
  capture::PtyProxy proxy_;
};

class LandmarkLink final : public CaptureLink {
 public:
  explicit LandmarkLink(CaptureWriter& writer) : forwarder_(writer) {}
  Status open(config::LandmarkConfig& landmarks) {
    const auto port = free_udp_port();
    if (!port) return port.error();
    const Status opened = forwarder_.open(landmarks.address, static_cast<std::uint16_t>(landmarks.port), *port);
    if (!opened) return opened;
    landmarks.address = kLoopback;
    landmarks.port = port_ = *port;
    return {};
  }
  [[nodiscard]] std::string advice() const override {
    return configure("[tracker.landmarks]\naddress = \"" + kLoopback + "\"\nport = " + std::to_string(port_) + "\n");
  }

 private:
  /// Nobody holds it until the driver binds it.
  static Result<std::uint16_t> free_udp_port() {
    const auto socket = transport::udp_bind(kLoopback, 0, 4096);
    if (!socket) return socket.error();
    return transport::local_port(socket->get());
  }

  capture::UdpForwarder forwarder_;
  int port_{0};
};

}  // namespace

capture::Header link_header(CapturedDevice device, const config::EmbodyConfig& config) {
  capture::Header header;
  const bool is_landmarks = config.tracker.driver == config::TrackerDriver::kLandmarks;
  if (device == CapturedDevice::kArm) {
    header.link = capture::LinkKind::kRtde;
    header.peer = at(config.arm.host, config.arm.port);
  } else if (device == CapturedDevice::kHand && is_on_can(config.hand)) {
    header.link = capture::LinkKind::kCan;
    header.peer = can_peer(config.hand.mia);
  } else if (device == CapturedDevice::kHand) {
    header.link = capture::LinkKind::kSerial;
    header.peer = config.hand.device;
  } else if (is_landmarks) {
    header.link = capture::LinkKind::kUdp;
    header.peer = at(config.tracker.landmarks.address, config.tracker.landmarks.port);
  } else {
    header.link = capture::LinkKind::kQtm;
    header.peer = at(config.tracker.host, config.tracker.port);
  }
  return header;
}

Result<std::unique_ptr<CaptureLink>> open_capture_link(CapturedDevice device, config::EmbodyConfig& config,
                                                       CaptureWriter& writer) {
  if (device == CapturedDevice::kArm) {
    auto link = std::make_unique<ArmLink>(writer);
    const Status opened = link->open(config.arm);
    return link_or_error(std::move(link), opened);
  }
  if (device == CapturedDevice::kHand && config.hand.driver == config::HandDriverKind::kJointState) {
    return make_error(Errc::kUnsupported, "a hand with [hand] driver \"joint_state\" has no link but its DDS topics");
  }
  if (device == CapturedDevice::kHand && is_on_can(config.hand)) return listen_on_can(config.hand.mia, writer);
  if (device == CapturedDevice::kHand) {
    auto link = std::make_unique<SerialLink>(writer);
    const Status opened = link->open(config.hand);
    return link_or_error(std::move(link), opened);
  }
  if (config.tracker.driver == config::TrackerDriver::kLandmarks) {
    auto link = std::make_unique<LandmarkLink>(writer);
    const Status opened = link->open(config.tracker.landmarks);
    return link_or_error(std::move(link), opened);
  }
  auto link = std::make_unique<QtmLink>(writer);
  const Status opened = link->open(config.tracker);
  return link_or_error(std::move(link), opened);
}

}  // namespace embody::ctl
