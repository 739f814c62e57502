#include "drivers/sim/mia/mia_simulator.hpp"

#include "drivers/sim/mia/device.hpp"
#include "drivers/sim/serial/pty_thread.hpp"
#include "drivers/transport/clock.hpp"

namespace embody::sim {

/// The thread and its line.
class MiaSimulator::Device final : public PtyThread<MiaDevice> {
 public:
  explicit Device(const MiaSimulatorConfig& config) : PtyThread(config.link, config, transport::now()) {}
};

MiaSimulator::MiaSimulator(const MiaSimulatorConfig& config) : device_(std::make_unique<Device>(config)) {}

MiaSimulator::~MiaSimulator() = default;

Status MiaSimulator::start() {
  return device_->start();
}

void MiaSimulator::stop() noexcept {
  device_->stop();
}

void MiaSimulator::unplug() {
  device_->stop();
}

std::string MiaSimulator::device() const {
  return device_->path();
}

MiaSimulatorCounters MiaSimulator::counters() const {
  return device_->with([](const MiaDevice& hand) { return hand.counters(); });
}

// The hand moves although nobody polls it: it is brought up to date before it is looked at.

std::array<double, mia::kMotors> MiaSimulator::motor_counts() const {
  return device_->with([](MiaDevice& hand) {
    hand.move_to(transport::now());
    return hand.motor_counts();
  });
}

std::array<double, mia::kMotors> MiaSimulator::joint_angles_rad() const {
  return device_->with([](MiaDevice& hand) {
    hand.move_to(transport::now());
    return hand.joint_angles_rad();
  });
}

std::vector<MiaSample> MiaSimulator::log() const {
  return device_->with([](MiaDevice& hand) {
    hand.move_to(transport::now());
    return hand.log();
  });
}

void MiaSimulator::mute(bool on) {
  device_->with([on](MiaDevice& hand) { hand.mute(on); });
}

void MiaSimulator::drop_next(unsigned n) {
  device_->with([n](MiaDevice& hand) { hand.drop_next(n); });
}

void MiaSimulator::garble_next(unsigned n) {
  device_->with([n](MiaDevice& hand) { hand.garble_next(n); });
}

Status MiaSimulator::fault(std::string_view text) {
  if (text == "unplug") return unplug(), Status{};
  if (text == "plug") return start();
  const Status done = device_->with([text](MiaDevice& hand) { return hand.fault(text, transport::now()); });
  device_->wake();
  return done;
}

}  // namespace embody::sim
