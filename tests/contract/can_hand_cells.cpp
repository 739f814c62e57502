// The Mia hand on the double of a CAN bus: both framings of the tunnel, and the compact profile.
#include <linux/can.h>

#include <optional>

#include "drivers/mia/can_line.hpp"
#include "drivers/mia/compact/mia_can_hand.hpp"
#include "drivers/mia/mia_hand.hpp"
#include "drivers/sim/mia/can_simulator.hpp"
#include "drivers/transport/can_double.hpp"
#include "tests/contract/hand_cell.hpp"
#include "tests/contract/mia_poses.hpp"
#include "tests/contract/relay.hpp"

namespace embody::test {
namespace {

using std::chrono::milliseconds;

class CanCell : public HandCell {
 public:
  CanCell(sim::CanProfile profile, mia::CanFraming framing)
      : path_(unique_path("can_hand")), interface_("unix:" + unique_path("can")), simulator_(config(profile, framing)) {
    set_mia_poses(*this);
    hang_up_bound = milliseconds(20);
    const Status started = simulator_.start();
    EXPECT_TRUE(started.ok()) << started.error().detail.view();
    relay_.emplace(can_socket(interface_), [this] { return transport::double_connect(path_); });
  }

  void cut() override { relay_->cut(); }
  void restore() override { relay_->restore(); }
  void hush() override { relay_->hush(); }
  void babble(std::mt19937& random) override {
    for (int i = 0; i < 10; ++i) {
      relay_->inject(rubbish(random, mia::kMaxMessage));
      if (ids_.empty()) continue;
      can_frame frame{};
      frame.can_id = ids_[random() % ids_.size()];
      frame.can_dlc = static_cast<std::uint8_t>(random() % (CAN_MAX_DLEN + 1));
      for (std::uint8_t& byte : frame.data) byte = static_cast<std::uint8_t>(random());
      relay_->inject(std::as_bytes(std::span(&frame, 1)));
    }
  }
  std::vector<double> motors() override {
    const auto counts = simulator_.motor_counts();
    return {counts.begin(), counts.end()};
  }
  std::uint64_t motions() override { return simulator_.counters().motions; }

 protected:
  [[nodiscard]] mia::CanTunnelConfig tunnel() const {
    mia::CanTunnelConfig config;
    config.interface = interface_;
    config.framing = framing_;
    return config;
  }
  [[nodiscard]] const std::string& interface() const { return interface_; }
  std::vector<std::uint32_t> ids_;  ///< of raw frames that the driver listens to

 private:
  sim::CanSimulatorConfig config(sim::CanProfile profile, mia::CanFraming framing) {
    framing_ = framing;
    sim::CanSimulatorConfig config;
    config.interface = "unix:" + path_;
    config.profile = profile;
    config.tunnel.framing = framing;
    return config;
  }

  std::string path_, interface_;
  mia::CanFraming framing_{};
  sim::MiaCanSimulator simulator_;
  std::optional<Relay> relay_;
};

class TunnelCell final : public CanCell {
 public:
  explicit TunnelCell(mia::CanFraming framing) : CanCell(sim::CanProfile::kTunnel, framing) {
    silence_bound = milliseconds(5 * (20 + 20 + 50));  // as on the serial line
    if (framing == mia::CanFraming::kSegments) ids_ = {mia::CanTunnelConfig{}.rx.value};
  }
  std::unique_ptr<HandDriver> driver(Pace pace) override {
    mia::MiaConfig config;
    config.device = interface();
    config.speed_percent = kMiaSpeed_percent;
    if (pace == Pace::kPatient) config.ack_timeout = milliseconds(150);
    return std::make_unique<mia::MiaHand>(config, mia::can_line(tunnel()));
  }
};

class CompactCell final : public CanCell {
 public:
  CompactCell() : CanCell(sim::CanProfile::kCompact, mia::CanFraming::kSegments) {
    const mia::compact::CompactConfig delivered;
    silence_bound = delivered.state_timeout;
    for (std::uint32_t i = mia::compact::kStateId; i <= mia::compact::kLastId; ++i) {
      ids_.push_back(delivered.ids.at(i).value);
    }
  }
  std::unique_ptr<HandDriver> driver(Pace pace) override {
    mia::compact::CompactConfig config;
    config.interface = interface();
    config.speed_percent = kMiaSpeed_percent;
    if (pace == Pace::kPatient) {
      config.ack_timeout = milliseconds(150);
      config.state_timeout = kPatience;
    }
    return std::make_unique<mia::compact::MiaCanHand>(config);
  }
};

}  // namespace

std::unique_ptr<HandCell> mia_can_isotp() {
  return std::make_unique<TunnelCell>(mia::CanFraming::kIsoTp);
}

std::unique_ptr<HandCell> mia_can_segments() {
  return std::make_unique<TunnelCell>(mia::CanFraming::kSegments);
}

std::unique_ptr<HandCell> mia_can_compact() {
  return std::make_unique<CompactCell>();
}

}  // namespace embody::test
