// Hands on a serial line: both generations of the Mia hand, and the Robotiq gripper.
#include <optional>

#include "drivers/mia/mia_hand.hpp"
#include "drivers/robotiq/robotiq_hand.hpp"
#include "drivers/sim/mia/mia_simulator.hpp"
#include "drivers/sim/robotiq/robotiq_simulator.hpp"
#include "drivers/transport/tty.hpp"
#include "tests/contract/hand_cell.hpp"
#include "tests/contract/mia_poses.hpp"
#include "tests/contract/relay.hpp"

namespace embody::test {
namespace {

using std::chrono::milliseconds;

template <class Simulator>
class SerialCell : public HandCell {
 public:
  template <class Config>
  SerialCell(const char* name, const Config& config) : simulator_(config), device_(unique_path(name)) {
    const Status started = simulator_.start();
    EXPECT_TRUE(started.ok()) << started.error().detail.view();
    relay_.emplace(serial_socket(device_), [this]() -> Result<transport::UniqueFd> {
      auto tty = transport::open_tty(simulator_.device());
      if (!tty) return tty.error();
      return std::move(tty->fd);
    });
  }

  void cut() override { relay_->cut(); }
  void restore() override { relay_->restore(); }
  void hush() override { relay_->hush(); }
  void babble(std::mt19937& random) override { relay_->inject(rubbish(random, 200)); }
  std::uint64_t motions() override { return simulator_.counters().motions; }

 protected:
  Simulator simulator_;
  std::string device_;

 private:
  std::optional<Relay> relay_;
};

class MiaCell final : public SerialCell<sim::MiaSimulator> {
 public:
  MiaCell(const char* name, const sim::MiaSimulatorConfig& config) : SerialCell(name, config) {
    set_mia_poses(*this);
    // Hang-up: the next read(). Silence: five time-outs in a row of 20 ms each, with a pause after every second one to
    // find back into step (20 ms), while cycles come every 50 ms; or the stream's limit.
    hang_up_bound = milliseconds(20);
    const bool streams = config.generation == mia::Generation::kStreaming;
    silence_bound = streams ? mia::MiaConfig{}.silence_limit : milliseconds(5 * (20 + 20 + 50));
  }
  std::unique_ptr<HandDriver> driver(Pace pace) override {
    mia::MiaConfig config;
    config.device = device_;
    config.speed_percent = kMiaSpeed_percent;
    if (pace == Pace::kPatient) {
      config.ack_timeout = milliseconds(150);
      config.silence_limit = kPatience;
    }
    return std::make_unique<mia::MiaHand>(config);
  }
  std::vector<double> motors() override {
    const auto counts = simulator_.motor_counts();
    return {counts.begin(), counts.end()};
  }
};

class RobotiqCell final : public SerialCell<sim::RobotiqSimulator> {
 public:
  RobotiqCell() : SerialCell("robotiq", activated()) {
    near_rad = {0.2};
    far_rad = {0.65};
    const robotiq::PositionScale scale;
    near_units = {1.0 * robotiq::counts_of(scale, near_rad[0])};
    far_units = {1.0 * robotiq::counts_of(scale, far_rad[0])};
    most_units = {sim::RobotiqGripperConfig{}.max_counts};
    hang_up_bound = milliseconds(20);
    silence_bound = milliseconds(5 * (40 + 20));  // five exchanges in a row, each 40 ms, at 50 cycles per second
  }
  std::unique_ptr<HandDriver> driver(Pace pace) override {
    robotiq::RobotiqConfig config;
    config.device = device_;
    config.speed = 20;  // of 255: 47 mm/s, so that the far pose takes two seconds
    if (pace == Pace::kPatient) config.reply_timeout = milliseconds(150);
    return std::make_unique<robotiq::RobotiqHand>(config);
  }
  std::vector<double> motors() override { return {simulator_.counts()}; }

 private:
  static sim::RobotiqSimulatorConfig activated() {
    sim::RobotiqSimulatorConfig config;
    config.gripper.activated = true;
    config.gripper.start_counts = 50.0;
    return config;
  }
};

}  // namespace

std::unique_ptr<HandCell> mia_serial_acknowledging() {
  return std::make_unique<MiaCell>("mia", sim::MiaSimulatorConfig{});
}

std::unique_ptr<HandCell> mia_serial_streaming() {
  return std::make_unique<MiaCell>("mia_old", sim::older_mia());
}

std::unique_ptr<HandCell> robotiq() {
  return std::make_unique<RobotiqCell>();
}

}  // namespace embody::test
