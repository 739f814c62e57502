#pragma once
// A driver of a Mia hand and a simulated hand, connected by the double of a CAN bus.
#include <gtest/gtest.h>
#include <unistd.h>

#include <functional>
#include <optional>
#include <string>

#include "drivers/mia/can_line.hpp"
#include "drivers/mia/compact/mia_can_hand.hpp"
#include "drivers/mia/mia_hand.hpp"
#include "drivers/sim/mia/can_simulator.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::test {

using std::chrono::milliseconds;
using std::chrono::seconds;

inline std::string double_name() {
  static int number = 0;
  return "unix:" + ::testing::TempDir() + "embody_mia_can_" + std::to_string(::getpid()) + "_" +
         std::to_string(number++);
}

inline HandCommand move(double thumb_rad, double index_rad, double mrl_rad, Duration valid = seconds(2)) {
  HandCommand command;
  command.action = HandAction::kMove;
  command.joint_count = mia::kMotors;
  command.q_rad = {thumb_rad, index_rad, mrl_rad};
  command.t_expires = transport::now() + valid;
  return command;
}
inline HandCommand plain(HandAction action) {
  HandCommand command;
  command.action = action;
  return command;
}

/// One turn of a hand loop after the other, as the daemon does it.
struct HandLoop {
  HandDriver& hand;
  int fd;
  HandDeviceState state{};
  std::uint64_t replies{0};

  IoStatus turn() {
    static_cast<void>(transport::wait_readable(fd, transport::now() + milliseconds(5)));
    const IoStatus status = hand.read(state);
    if (status == IoStatus::kDone) ++replies;
    return status;
  }
  /// Turns until `done` or the session is over; false after `limit`.
  bool until(const std::function<bool()>& done, Duration limit = seconds(5)) {
    const TimePoint deadline = transport::now() + limit;
    while (transport::now() < deadline) {
      if (done()) return true;
      if (turn() == IoStatus::kDisconnected) return done();
    }
    return false;
  }
  /// Turns until the session is over; how long that took.
  std::optional<Duration> end(Duration limit = seconds(5)) {
    const TimePoint start = transport::now();
    while (transport::now() < start + limit) {
      if (turn() == IoStatus::kDisconnected) return transport::now() - start;
    }
    return std::nullopt;
  }
};

}  // namespace embody::test
