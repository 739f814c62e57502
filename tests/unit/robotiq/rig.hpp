#pragma once
// A Robotiq driver and a simulated gripper, connected by a real pseudo-terminal.
#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <utility>

#include "drivers/robotiq/robotiq_hand.hpp"
#include "drivers/sim/robotiq/robotiq_simulator.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::test {

using std::chrono::milliseconds;

inline robotiq::RobotiqConfig patient_config() {
  robotiq::RobotiqConfig config;
  config.reply_timeout = milliseconds(150);  // tests of other things must not trip over a busy machine
  return config;
}

inline robotiq::RobotiqConfig quick_config() {
  robotiq::RobotiqConfig config;
  config.reply_timeout = milliseconds(20);
  return config;
}

inline sim::RobotiqSimulatorConfig activated_gripper() {
  sim::RobotiqSimulatorConfig config;
  config.gripper.activated = true;
  config.gripper.start_counts = 50.0;
  return config;
}

struct RobotiqRig {
  explicit RobotiqRig(robotiq::RobotiqConfig config = patient_config(),
                      const sim::RobotiqSimulatorConfig& simulated = activated_gripper())
      : simulator(simulated) {
    const Status started = simulator.start();
    EXPECT_TRUE(started.ok()) << started.error().detail.view();
    config.device = simulated.link.empty() ? simulator.device() : simulated.link;
    hand.emplace(std::move(config));
    const auto connected = hand->connect();
    EXPECT_TRUE(connected.ok()) << connected.error().detail.view();
    if (connected) info = *connected;
  }

  /// One turn of a hand loop: waits until the line has something (at most 3 ms), then reads.
  IoStatus turn() {
    static_cast<void>(transport::wait_readable(info.fd, transport::now() + milliseconds(3)));
    const IoStatus status = hand->read(state);
    if (status == IoStatus::kDone) ++replies;
    return status;
  }

  /// Turns until `done` or the session is over; false after `limit`.
  bool turn_until(const std::function<bool()>& done, Duration limit = std::chrono::seconds(5)) {
    const TimePoint deadline = transport::now() + limit;
    while (transport::now() < deadline) {
      if (done()) return true;
      if (turn() == IoStatus::kDisconnected) return done();
    }
    return false;
  }

  /// Writes `command` (with a fresh expiry if it is a move that was made with one) and waits for the next status.
  bool cycle(const HandCommand& command) {
    return hand->write(command, transport::now()) == IoStatus::kDone &&
           turn_until([this, before = replies] { return replies > before; });
  }

  /// Moves towards `q_rad` until `done`.
  bool move_until(double q_rad, const std::function<bool()>& done, Duration limit = std::chrono::seconds(5)) {
    const TimePoint deadline = transport::now() + limit;
    while (!done()) {
      if (transport::now() > deadline || !cycle(move(q_rad))) return false;
    }
    return true;
  }

  /// Holds or stops at 50 Hz until the session is over; how long that took, or nothing after five seconds.
  std::optional<Duration> time_to_loss(HandAction action) {
    const TimePoint start = transport::now();
    TimePoint next = start;
    while (transport::now() < start + std::chrono::seconds(5)) {
      if (transport::now() >= next) {
        next += milliseconds(20);
        if (hand->write(plain(action), transport::now()) == IoStatus::kDisconnected) return transport::now() - start;
      }
      if (turn() == IoStatus::kDisconnected) return transport::now() - start;
    }
    return std::nullopt;
  }

  void inject(std::string_view words) {
    const Status done = simulator.fault(words);
    EXPECT_TRUE(done.ok()) << done.error().detail.view();
  }

  static HandCommand move(double q_rad, Duration valid = milliseconds(500)) {
    HandCommand command;
    command.action = HandAction::kMove;
    command.joint_count = 1;
    command.q_rad[0] = q_rad;
    command.t_expires = transport::now() + valid;
    return command;
  }
  static HandCommand plain(HandAction action) {
    HandCommand command;
    command.action = action;
    return command;
  }

  sim::RobotiqSimulator simulator;
  std::optional<robotiq::RobotiqHand> hand;
  HandInfo info;
  HandDeviceState state;
  std::uint64_t replies{0};
};

}  // namespace embody::test
