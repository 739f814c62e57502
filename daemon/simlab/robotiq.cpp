// The simulated Robotiq gripper as the lab's hand.
#include <cmath>

#include "daemon/simlab/hands.hpp"
#include "daemon/simlab/motion_log.hpp"
#include "drivers/sim/robotiq/robotiq_simulator.hpp"

namespace embody::sim {
namespace {

RobotiqSimulatorConfig simulator_config(const config::HandConfig& hand, const HandOptions& options) {
  RobotiqSimulatorConfig config;
  config.link = options.link;
  config.gripper.slave = hand.robotiq.slave;
  config.gripper.activated = true;
  return config;
}

robotiq::PositionScale scale_of(const config::HandConfig& hand) {
  robotiq::PositionScale scale;
  scale.open_rad = hand.embodiment.motor_lower_rad.front();
  scale.closed_rad = hand.embodiment.motor_upper_rad.front();
  return scale;
}

class Robotiq final : public SimulatedHand {
 public:
  Robotiq(const config::HandConfig& hand, const HandOptions& options)
      : scale_(scale_of(hand)),
        gripper_(simulator_config(hand, options)),
        log_(options.log_length_s, [this] { return joint_angles_rad(); }) {}

  [[nodiscard]] const char* name() const noexcept override { return "robotiq"; }
  Status start() override {
    if (Status started = gripper_.start(); !started) return started;
    log_.start();
    return {};
  }
  [[nodiscard]] std::string device() const override { return gripper_.device(); }
  [[nodiscard]] bool in_use() const override { return gripper_.counters().reads > 2; }
  [[nodiscard]] std::vector<double> joint_angles_rad() const override {
    return {robotiq::angle_of(scale_, static_cast<int>(std::lround(gripper_.counts())))};
  }
  [[nodiscard]] std::vector<HandSample> log() const override { return log_.samples(); }
  [[nodiscard]] std::vector<HandCounter> counters() const override {
    const RobotiqGripperCounters c = gripper_.counters();
    return {{"commands", c.requests},       {"motions", c.motions}, {"reads", c.reads},        {"stops", c.stops},
            {"activations", c.activations}, {"resets", c.resets},   {"too_early", c.too_early}};
  }
  Status fault(std::string_view words) override { return gripper_.fault(words); }
  [[nodiscard]] Status check_fault(std::string_view words) const override {
    const auto parsed = parse_robotiq_fault(words);
    return parsed ? Status() : Status(parsed.error());
  }
  [[nodiscard]] std::string fault_help() const override { return robotiq_fault_help(); }

 private:
  robotiq::PositionScale scale_;
  RobotiqSimulator gripper_;
  MotionLog log_;  // ends before the gripper that it looks at
};

}  // namespace

std::unique_ptr<SimulatedHand> make_robotiq(const config::HandConfig& hand, const HandOptions& options) {
  return std::make_unique<Robotiq>(hand, options);
}

}  // namespace embody::sim
