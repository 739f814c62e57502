// The simulated Mia on a pseudo-terminal as the lab's hand.
#include "daemon/simlab/hands.hpp"
#include "drivers/sim/mia/device.hpp"
#include "drivers/sim/mia/mia_simulator.hpp"

namespace embody::sim {
namespace {

class SerialMia final : public SimulatedHand {
 public:
  explicit SerialMia(const MiaSimulatorConfig& config) : config_(config), hand_(config) {}

  [[nodiscard]] const char* name() const noexcept override { return "mia"; }
  Status start() override { return hand_.start(); }
  [[nodiscard]] std::string device() const override { return hand_.device(); }
  [[nodiscard]] bool in_use() const override {
    const MiaSimulatorCounters counters = hand_.counters();
    const bool asks = config_.generation == mia::Generation::kAcknowledging;  // else it only switches streams on
    return asks ? counters.reads > 2 : counters.commands > 2;
  }
  [[nodiscard]] std::vector<double> joint_angles_rad() const override {
    const auto q_rad = hand_.joint_angles_rad();
    return {q_rad.begin(), q_rad.end()};
  }
  [[nodiscard]] std::vector<HandSample> log() const override {
    std::vector<HandSample> samples;
    for (const MiaSample& mia : hand_.log()) {
      HandSample& sample = samples.emplace_back();
      sample.t = mia.t;
      sample.count = mia.q_rad.size();
      std::copy(mia.q_rad.begin(), mia.q_rad.end(), sample.q_rad.begin());
    }
    return samples;
  }
  [[nodiscard]] std::vector<HandCounter> counters() const override {
    const MiaSimulatorCounters c = hand_.counters();
    return {{"commands", c.commands},
            {"motions", c.motions},
            {"reads", c.reads},
            {"stops", c.stops},
            {"dropped_as_early", c.dropped_as_early},
            {"restarts", c.restarts}};
  }
  Status fault(std::string_view words) override { return hand_.fault(words); }
  [[nodiscard]] Status check_fault(std::string_view words) const override {
    if (words == "unplug" || words == "plug") return {};
    return check_mia_fault(config_, words);
  }
  [[nodiscard]] std::string fault_help() const override { return mia_fault_help(); }

 private:
  MiaSimulatorConfig config_;
  MiaSimulator hand_;
};

}  // namespace

MiaSimulatorConfig mia_simulator_config(const config::HandConfig& hand, const HandOptions& options) {
  const bool configured_streaming = hand.mia.protocol == config::MiaProtocol::kStreaming;
  const auto generation = options.mia_generation.value_or(configured_streaming ? mia::Generation::kStreaming
                                                                               : mia::Generation::kAcknowledging);
  MiaSimulatorConfig config = generation == mia::Generation::kStreaming ? older_mia() : MiaSimulatorConfig{};
  config.link = options.link;
  config.log_capacity = static_cast<std::size_t>(options.log_length_s * 100.0);
  return config;
}

Status check_mia_fault(MiaSimulatorConfig config, std::string_view words) {
  config.log_capacity = 0;
  return MiaDevice(config, TimePoint{}).fault(words, TimePoint{});  // happens to a hand that nobody has
}

std::unique_ptr<SimulatedHand> make_serial_mia(const config::HandConfig& hand, const HandOptions& options) {
  return std::make_unique<SerialMia>(mia_simulator_config(hand, options));
}

}  // namespace embody::sim
