// The simulated QTM behind a relay: both byte orders, frames over UDP, and with a rigid body.
#include <cmath>
#include <mutex>
#include <optional>

#include "drivers/qualisys/qualisys_tracker.hpp"
#include "drivers/sim/qtm/qtm_server.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/transport/udp.hpp"
#include "tests/contract/relay.hpp"
#include "tests/contract/tracker_cell.hpp"

namespace embody::test {
namespace {

const std::vector<std::string> kMarkers{"hand_top", "hand_left", "hand_right", "thumb_tip", "index_tip"};
constexpr double kRate_hz = 100.0;

/// Markers that are nowhere near the origin and sway a little.
sim::Motion swaying() {
  sim::Motion motion;
  motion.rate_hz = kRate_hz;
  motion.marker_names = kMarkers;
  motion.source = "swaying markers";
  motion.generate = [](std::size_t frame, std::span<Marker> markers) {
    const double sway_m = 0.05 * std::sin(0.05 * static_cast<double>(frame));
    for (std::size_t i = 0; i < markers.size(); ++i) {
      const auto k = static_cast<double>(i);
      markers[i].p_W = {0.3 + sway_m, 0.1 + 0.05 * k, 0.2 + 0.03 * k * k};
      markers[i].visible = true;
    }
  };
  return motion;
}

sim::QtmServerConfig with_big_endian() {
  sim::QtmServerConfig config;
  config.big_endian_port = 0;
  return config;
}

class QtmCell final : public TrackerCell {
 public:
  explicit QtmCell(const qualisys::QualisysConfig& config) : config_(config), qtm_(with_big_endian(), swaying()) {
    marker_count = kMarkers.size();
    rate_hz = kRate_hz;
    has_body = !config_.rigid_body.empty();
    hang_up_bound = std::chrono::milliseconds(20);
    // Nobody but service() notices, once a second: it waits for an answer.
    silence_bound = std::chrono::seconds(1) + config_.reply_timeout;
    const Status started = qtm_.start();
    EXPECT_TRUE(started.ok()) << started.error().detail.view();
    qtm_.play();
    const bool little = config_.byte_order == qualisys::ByteOrder::kLittle;
    relay_.emplace(
        tcp_socket(config_.port),
        [this, port = little ? qtm_.port() : qtm_.big_endian_port()] {
          return transport::tcp_connect("127.0.0.1", port, transport::now() + std::chrono::seconds(1));
        },
        [this](int, std::span<const std::byte> bytes) {
          const std::scoped_lock lock(mutex_);
          for (const std::byte byte : bytes) heard_ += static_cast<char>(byte);
        });
    if (config_.transport == qualisys::Transport::kUdp) {
      const auto free_one = transport::udp_bind("127.0.0.1", 0, 1 << 16);
      config_.udp_port = transport::local_port(free_one->get());
    }
  }

  std::unique_ptr<HandTracker> driver() override {
    return std::make_unique<qualisys::QualisysTracker>(config_, kMarkers);
  }
  void cut() override { relay_->cut(); }
  void restore() override {
    fault("half_open off");
    relay_->restore();
  }
  void hush() override { fault("half_open on"); }
  void hide(bool on) override { EXPECT_TRUE(qtm_.set_marker_hidden(kMarkers[kHiddenSlot], on)); }
  void babble(std::mt19937& random) override {
    const auto bytes = rubbish(random, 400);
    const bool udp = config_.transport == qualisys::Transport::kUdp;
    if (!udp || random() % 8 == 0) relay_->inject(bytes);
    if (!udp) return;
    const auto out = transport::udp_connect("127.0.0.1", config_.udp_port);
    for (int i = 0; i < 10; ++i) static_cast<void>(transport::send_message(out->get(), rubbish(random, 1400)));
  }
  std::string heard() override {
    const std::scoped_lock lock(mutex_);
    return heard_;
  }

 private:
  void fault(std::string_view words) {
    const Status done = qtm_.fault(words);
    EXPECT_TRUE(done.ok()) << done.error().detail.view();
  }

  qualisys::QualisysConfig config_;
  sim::QtmServer qtm_;
  std::mutex mutex_;
  std::string heard_;
  std::optional<Relay> relay_;
};

}  // namespace

std::unique_ptr<TrackerCell> qtm_little_endian() {
  return std::make_unique<QtmCell>(qualisys::QualisysConfig{});
}

std::unique_ptr<TrackerCell> qtm_big_endian() {
  qualisys::QualisysConfig config;
  config.byte_order = qualisys::ByteOrder::kBig;
  return std::make_unique<QtmCell>(config);
}

std::unique_ptr<TrackerCell> qtm_udp() {
  qualisys::QualisysConfig config;
  config.transport = qualisys::Transport::kUdp;
  return std::make_unique<QtmCell>(config);
}

std::unique_ptr<TrackerCell> qtm_rigid_body() {
  qualisys::QualisysConfig config;
  config.rigid_body = "hand";
  return std::make_unique<QtmCell>(config);
}

}  // namespace embody::test
