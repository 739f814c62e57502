#pragma once
// A Mia hand driver and a simulated hand, connected by a real pseudo-terminal.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "drivers/mia/mia_hand.hpp"
#include "drivers/sim/mia/mia_simulator.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::test {

using std::chrono::milliseconds;

inline mia::MiaConfig patient_config() {
  mia::MiaConfig config;
  config.ack_timeout = milliseconds(150);  // tests of other things must not trip over a busy machine
  return config;
}

inline mia::MiaConfig quick_config() {
  mia::MiaConfig config;
  config.ack_timeout = milliseconds(20);
  return config;
}

struct MiaRig {
  explicit MiaRig(mia::MiaConfig config = patient_config(), sim::MiaSimulatorConfig simulated = {})
      : simulator(std::move(simulated)) {
    const Status started = simulator.start();
    EXPECT_TRUE(started.ok()) << started.error().detail.view();
    config.device = simulator.device();
    hand.emplace(std::move(config));
    const auto connected = hand->connect();
    EXPECT_TRUE(connected.ok()) << connected.error().detail.view();
    if (connected) info = *connected;
  }

  /// One turn of a hand loop: waits until the line has something (at most 5 ms), then reads.
  IoStatus turn() {
    static_cast<void>(transport::wait_readable(info.fd, transport::now() + milliseconds(5)));
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

  /// Runs turns until one more reply came.
  bool next_reply() {
    return turn_until([this, before = replies] { return replies > before; });
  }

  /// A whole cycle: writes `command` and waits for the position reply.
  bool cycle(const HandCommand& command) {
    return hand->write(command, transport::now()) == IoStatus::kDone && next_reply();
  }

  /// Cycles until the hand reports `counts` of `motor` within half a count.
  bool arrives(const HandCommand& command, std::size_t motor, double counts) {
    const TimePoint deadline = transport::now() + std::chrono::seconds(5);
    while (transport::now() < deadline) {
      HandCommand fresh = command;
      fresh.t_expires = transport::now() + milliseconds(500);
      if (!cycle(fresh)) return false;
      if (std::abs(simulator.motor_counts()[motor] - counts) < 0.5) return true;
    }
    return false;
  }

  static HandCommand move(double thumb_rad, double index_rad, double mrl_rad, Duration valid = milliseconds(500)) {
    HandCommand command;
    command.action = HandAction::kMove;
    command.joint_count = mia::kMotors;
    command.q_rad = {thumb_rad, index_rad, mrl_rad};
    command.t_expires = transport::now() + valid;
    return command;
  }
  static HandCommand plain(HandAction action) {
    HandCommand command;
    command.action = action;
    return command;
  }

  sim::MiaSimulator simulator;
  std::optional<mia::MiaHand> hand;
  HandInfo info;
  HandDeviceState state;
  std::uint64_t replies{0};
};

}  // namespace embody::test
