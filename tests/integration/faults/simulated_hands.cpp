// The simulated robot hands of the matrix.
#include "drivers/mia/transmission.hpp"
#include "drivers/robotiq/registers.hpp"
#include "drivers/sim/mia/can_simulator.hpp"
#include "drivers/sim/mia/mia_simulator.hpp"
#include "drivers/sim/robotiq/robotiq_simulator.hpp"
#include "tests/integration/faults/devices.hpp"

namespace embody::faults {
namespace {

class SerialMia final : public SimulatedHand {
 public:
  SerialMia(sim::MiaSimulatorConfig config, const std::string& link) : hand_(with_link(std::move(config), link)) {}
  Status start() override { return hand_.start(); }
  Status fault(std::string_view words) override { return hand_.fault(words); }
  std::vector<double> angles_rad() const override {
    const auto q = hand_.joint_angles_rad();
    return {q.begin(), q.end()};
  }
  std::uint64_t motions() const override { return hand_.counters().motions; }

 private:
  static sim::MiaSimulatorConfig with_link(sim::MiaSimulatorConfig config, const std::string& link) {
    config.link = link;
    config.log_capacity = 10;
    config.calibration_time = std::chrono::milliseconds(500);
    return config;
  }
  sim::MiaSimulator hand_;
};

class CanMia final : public SimulatedHand {
 public:
  explicit CanMia(const std::string& link) : hand_(with_interface(link)) {}
  Status start() override {
    if (const Status started = hand_.start(); !started) return started;
    return hand_.fault("calibrate");
  }
  Status fault(std::string_view words) override { return hand_.fault(words); }
  std::vector<double> angles_rad() const override {
    const auto q = mia::joint_angles_rad({}, hand_.motor_counts());
    return {q.begin(), q.end()};
  }
  std::uint64_t motions() const override { return hand_.counters().motions; }

 private:
  static sim::CanSimulatorConfig with_interface(const std::string& link) {
    sim::CanSimulatorConfig config;
    config.interface = "unix:" + link;
    return config;
  }
  sim::MiaCanSimulator hand_;
};

class Robotiq final : public SimulatedHand {
 public:
  explicit Robotiq(const std::string& link) : hand_(with_link(link)) {}
  Status start() override { return hand_.start(); }
  Status fault(std::string_view words) override { return hand_.fault(words); }
  std::vector<double> angles_rad() const override {
    const robotiq::PositionScale scale;
    const double share = (hand_.counts() - scale.open_counts) / (scale.closed_counts - scale.open_counts);
    return {scale.open_rad + share * (scale.closed_rad - scale.open_rad)};
  }
  std::uint64_t motions() const override { return hand_.counters().motions; }

 private:
  static sim::RobotiqSimulatorConfig with_link(const std::string& link) {
    sim::RobotiqSimulatorConfig config;
    config.link = link;
    config.gripper.activated = true;  // as `embodyctl hand activate` leaves it
    return config;
  }
  sim::RobotiqSimulator hand_;
};

}  // namespace

std::unique_ptr<SimulatedHand> make_hand(HandKind kind, const std::string& link) {
  switch (kind) {
    case HandKind::kMia:
      return std::make_unique<SerialMia>(sim::MiaSimulatorConfig{}, link);
    case HandKind::kStreamingMia:
      return std::make_unique<SerialMia>(sim::older_mia(), link);
    case HandKind::kCanMia:
      return std::make_unique<CanMia>(link);
    case HandKind::kRobotiq:
      return std::make_unique<Robotiq>(link);
  }
  return nullptr;
}

}  // namespace embody::faults
