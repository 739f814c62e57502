// The simulated Mia behind a CAN gateway as the lab's hand.
#include "daemon/app/devices.hpp"
#include "daemon/simlab/hands.hpp"
#include "daemon/simlab/motion_log.hpp"
#include "drivers/sim/mia/can_faults.hpp"
#include "drivers/sim/mia/can_simulator.hpp"

namespace embody::sim {
namespace {

CanSimulatorConfig simulator_config(const config::HandConfig& hand, const HandOptions& options) {
  CanSimulatorConfig config;
  config.interface = hand.mia.can_interface;
  const bool compact = hand.mia.wire == config::MiaWire::kCanCompact;
  config.profile = compact ? CanProfile::kCompact : CanProfile::kTunnel;
  config.tunnel = can_tunnel_config(hand.mia);
  config.serial_hand = mia_simulator_config(hand, options);
  config.serial_hand.link.clear();
  config.compact_hand.ids.base = {static_cast<std::uint32_t>(hand.mia.can_base_id), hand.mia.can_extended_ids};
  return config;
}

class CanMia final : public SimulatedHand {
 public:
  CanMia(const config::HandConfig& hand, const HandOptions& options)
      : config_(simulator_config(hand, options)),
        hand_(config_),
        log_(options.log_length_s, [this] { return joint_angles_rad(); }) {}

  [[nodiscard]] const char* name() const noexcept override { return "mia"; }
  Status start() override {
    if (const Status started = hand_.start(); !started) {
      return make_error(started.error().code,
                        "the simulated Mia needs the CAN interface of [hand.mia] can_interface: %s",
                        started.error().detail.c_str());
    }
    log_.start();
    return {};
  }
  [[nodiscard]] std::string device() const override { return config_.interface; }
  /// Before the operator engages, a driver of the compact profile says no more than that it is alive.
  [[nodiscard]] bool in_use() const override {
    return hand_.counters().commands + hand_.compact_counters().heartbeats > 2;
  }
  [[nodiscard]] std::vector<double> joint_angles_rad() const override {
    const auto q_rad = mia::joint_angles_rad({}, hand_.motor_counts());
    return {q_rad.begin(), q_rad.end()};
  }
  [[nodiscard]] std::vector<HandSample> log() const override { return log_.samples(); }
  [[nodiscard]] std::vector<HandCounter> counters() const override {
    const CanSimulatorCounters c = hand_.counters();
    return {{"commands", c.commands}, {"motions", c.motions}, {"stops", c.stops}, {"hosts", c.hosts}};
  }
  Status fault(std::string_view words) override { return hand_.fault(words); }
  [[nodiscard]] Status check_fault(std::string_view words) const override {
    if (words == "down" || words == "up" || bus_fault(words)) return {};
    if (config_.profile == CanProfile::kTunnel) return check_mia_fault(config_.serial_hand, words);
    CompactHand nobodys({}, TimePoint{});
    return compact_fault(nobodys, words);
  }
  [[nodiscard]] std::string fault_help() const override {
    const bool compact = config_.profile == CanProfile::kCompact;
    return can_fault_help(compact) + (compact ? "" : mia_fault_help());
  }

 private:
  CanSimulatorConfig config_;
  MiaCanSimulator hand_;
  MotionLog log_;  // ends before the hand that it looks at
};

}  // namespace

std::unique_ptr<SimulatedHand> make_can_mia(const config::HandConfig& hand, const HandOptions& options) {
  return std::make_unique<CanMia>(hand, options);
}

}  // namespace embody::sim
