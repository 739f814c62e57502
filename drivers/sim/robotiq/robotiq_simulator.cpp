#include "drivers/sim/robotiq/robotiq_simulator.hpp"

#include "drivers/sim/serial/pty_thread.hpp"
#include "drivers/transport/clock.hpp"

namespace embody::sim {

/// The thread and its line.
class RobotiqSimulator::Line final : public PtyThread<RobotiqGripper> {
 public:
  explicit Line(const RobotiqSimulatorConfig& config) : PtyThread(config.link, config.gripper, transport::now()) {}

  /// Calls `function` with the gripper as it is now.
  template <class Function>
  auto with_gripper(Function function) {
    return with([&function](RobotiqGripper& gripper) {
      gripper.receive({}, transport::now());  // moves it on
      return function(gripper);
    });
  }
};

RobotiqSimulator::RobotiqSimulator(const RobotiqSimulatorConfig& config) : line_(std::make_unique<Line>(config)) {}

RobotiqSimulator::~RobotiqSimulator() = default;

Status RobotiqSimulator::start() {
  return line_->start();
}

void RobotiqSimulator::stop() noexcept {
  line_->stop();
}

std::string RobotiqSimulator::device() const {
  return line_->path();
}

Status RobotiqSimulator::apply(const RobotiqFault& fault) {
  if (fault.kind == RobotiqFault::Kind::kPlug) return line_->start();
  if (fault.kind == RobotiqFault::Kind::kUnplug) {
    line_->stop();
  } else {
    line_->with_gripper([&fault](RobotiqGripper& gripper) { gripper.apply(fault); });
  }
  return {};
}

Status RobotiqSimulator::fault(std::string_view words) {
  const auto parsed = parse_robotiq_fault(words);
  if (!parsed) return parsed.error();
  return apply(*parsed);
}

double RobotiqSimulator::counts() const {
  return line_->with_gripper([](const RobotiqGripper& gripper) { return gripper.counts(); });
}

double RobotiqSimulator::travelled_counts() const {
  return line_->with_gripper([](const RobotiqGripper& gripper) { return gripper.travelled_counts(); });
}

robotiq::GripperStatus RobotiqSimulator::status() const {
  return line_->with_gripper([](const RobotiqGripper& gripper) { return gripper.status(); });
}

RobotiqGripperCounters RobotiqSimulator::counters() const {
  return line_->with_gripper([](const RobotiqGripper& gripper) { return gripper.counters(); });
}

}  // namespace embody::sim
