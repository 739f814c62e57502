// The simulated trackers of the matrix.
#include <atomic>
#include <mutex>
#include <optional>
#include <random>
#include <thread>

#include "drivers/landmarks/codec.hpp"
#include "drivers/sim/qtm/qtm_server.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/transport/udp.hpp"
#include "tests/integration/faults/devices.hpp"
#include "tests/integration/faults/operator_motion.hpp"

namespace embody::faults {
namespace {

class Qtm final : public SimulatedTracker {
 public:
  explicit Qtm(TrackerKind kind) : kind_(kind), server_({}, operator_markers()) {}
  Status start() override {
    if (const Status started = server_.start(); !started) return started;
    server_.play();
    return {};
  }
  Status fault(std::string_view words) override { return server_.fault(words); }
  std::string config() const override {
    std::string toml = "port = " + std::to_string(server_.port()) + "\n";
    if (kind_ == TrackerKind::kUdp) toml += "transport = \"udp\"\n";
    if (kind_ == TrackerKind::kRigidBody) toml += "rigid_body = \"hand\"\n";
    return toml;
  }

 private:
  TrackerKind kind_;
  sim::QtmServer server_;
};

std::uint16_t free_udp_port() {
  const auto socket = transport::udp_bind("127.0.0.1", 0, 4096);
  return socket ? transport::local_port(socket->get()) : std::uint16_t{0};
}

/// Sends the operator's landmarks at 60 Hz, or what a fault makes of them.
class Landmarks final : public SimulatedTracker {
 public:
  Landmarks() : port_(free_udp_port()) {}
  Status start() override {
    auto socket = transport::udp_connect("127.0.0.1", port_);
    if (!socket) return socket.error();
    socket_ = std::move(*socket);
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
    return {};
  }
  /// "none", or one of what send() knows.
  Status fault(std::string_view words) override {
    const std::scoped_lock lock(mutex_);
    if (words == "restart") {
      number_ = 0;
    } else {
      fault_ = words;
    }
    return {};
  }
  std::string config() const override {
    return "driver = \"landmarks\"\n[tracker.landmarks]\nrate_hz = 60\nport = " + std::to_string(port_) + "\n";
  }

 private:
  static constexpr double kRate_hz = 60.0;

  void run(const std::stop_token& stop) {
    const TimePoint t_start = transport::now();
    for (std::size_t k = 0; !stop.stop_requested(); ++k) {
      const TimePoint t = t_start + from_seconds(static_cast<double>(k) / kRate_hz);
      std::this_thread::sleep_until(t);
      send(operator_.landmarks(to_seconds(transport::now() - t_start)));
    }
  }

  void send(const std::array<Eigen::Vector3d, hand::kLandmarks>& p_W) {
    const std::scoped_lock lock(mutex_);
    if (fault_ == "silence") return;
    landmarks::LandmarkFrame frame;
    frame.frame_number = ++number_;
    frame.t_capture_ns =
        std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch()).count();
    if (fault_ == "other_hand") frame.side = Side::kLeft;
    const float confidence = fault_ == "unsure" ? 0.05F : 0.9F;
    const float offset = fault_ == "jump" ? 0.3F : 0.0F;
    for (std::size_t i = 0; i < p_W.size(); ++i) {
      frame.landmarks[i] = {
          {static_cast<float>(p_W[i].x()) + offset, static_cast<float>(p_W[i].y()), static_cast<float>(p_W[i].z())},
          confidence};
    }
    if (fault_ == "not_a_number") frame.landmarks[0].p_W[0] = std::numeric_limits<float>::quiet_NaN();
    auto datagram = landmarks::encode(frame);
    if (fault_ == "garbage") {
      for (std::byte& b : datagram) b = static_cast<std::byte>(random_());
    }
    const int copies = fault_ == "duplicates" ? 3 : 1;
    for (int i = 0; i < copies; ++i) (void)transport::send_message(socket_.get(), datagram);
  }

  std::uint16_t port_;
  OperatorMotion operator_;
  transport::UniqueFd socket_;
  std::mutex mutex_;
  std::string fault_{"none"};
  std::uint64_t number_{0};
  std::minstd_rand random_{5};
  std::jthread thread_;
};

}  // namespace

std::unique_ptr<SimulatedTracker> make_tracker(TrackerKind kind) {
  if (kind == TrackerKind::kLandmarks) return std::make_unique<Landmarks>();
  return std::make_unique<Qtm>(kind);
}

}  // namespace embody::faults
