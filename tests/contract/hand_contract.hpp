#pragma once
// One session of a hand driver, as the hand loop would run it, for the laws that all of them obey.
#include <optional>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "tests/contract/hand_cell.hpp"

namespace embody::test {

struct HandKind {
  const char* name;
  std::unique_ptr<HandCell> (*make)();
};
inline void PrintTo(const HandKind& kind, std::ostream* out) {
  *out << kind.name;
}

class HandContract : public ::testing::TestWithParam<HandKind> {
 protected:
  void SetUp() override { cell_ = GetParam().make(); }

  void open(Pace pace = Pace::kPatient) {
    hand_ = cell_->driver(pace);
    ASSERT_NO_FATAL_FAILURE(connect());
  }
  void connect() {
    const auto connected = hand_->connect();
    ASSERT_TRUE(connected.ok()) << connected.error().detail.view();
    info_ = *connected;
  }
  [[nodiscard]] Status try_to_connect() {
    const auto connected = hand_->connect();
    if (!connected) return connected.error();
    info_ = *connected;
    return {};
  }

  [[nodiscard]] static HandCommand plain(HandAction action) {
    HandCommand command;
    command.action = action;
    return command;
  }
  [[nodiscard]] static HandCommand move(const std::vector<double>& q_rad,
                                        Duration valid = std::chrono::milliseconds(500)) {
    HandCommand command = plain(HandAction::kMove);
    command.joint_count = q_rad.size();
    std::copy(q_rad.begin(), q_rad.end(), command.q_rad.begin());
    command.t_expires = transport::now() + valid;
    return command;
  }

  /// Waits for the line, at most 5 ms, then reads.
  IoStatus turn() {
    static_cast<void>(transport::wait_readable(info_.fd, transport::now() + std::chrono::milliseconds(5)));
    return hand_->read(state_);
  }
  /// Runs the loop with a command of `make` in each cycle of 50 ms until `done`; false after `limit` or when the
  /// session has ended.
  bool run(const std::function<HandCommand()>& make, const std::function<bool()>& done, Duration limit = kPatience) {
    const TimePoint end = transport::now() + limit;
    TimePoint next = transport::now();
    while (!done()) {
      if (transport::now() >= end) return false;
      if (transport::now() >= next) {
        next = transport::now() + std::chrono::milliseconds(50);
        last_write_ = hand_->write(make(), transport::now());
      }
      if (turn() == IoStatus::kDisconnected) return done();
    }
    return true;
  }
  void hold_for(Duration span) {
    run([] { return plain(HandAction::kHold); }, [] { return false; }, span);
  }
  [[nodiscard]] bool is_at(const std::vector<double>& units) const {
    const auto motors = cell_->motors();
    for (std::size_t i = 0; i < motors.size(); ++i) {
      if (std::abs(motors[i] - units[i]) > cell_->tolerance) return false;
    }
    return true;
  }
  /// Moves until the motors are there.
  bool reach(const std::vector<double>& q_rad, const std::vector<double>& units) {
    return run([&] { return move(q_rad); }, [&] { return is_at(units); }, 2 * kPatience);
  }
  /// Commands the far pose until the motors are on the way, well before their end.
  bool set_out() {
    const double start = cell_->motors()[0];
    const double way = cell_->far_units[0] - start;
    return run([&] { return move(cell_->far_rad); }, [&] { return cell_->motors()[0] > start + 0.1 * way; });
  }
  /// Waits, without the driver, until the motors have stood still for 200 ms.
  std::vector<double> rest() {
    std::vector<double> last = cell_->motors();
    TimePoint since = transport::now();
    EXPECT_TRUE(eventually(
        [&] {
          if (!is_at(last)) {
            last = cell_->motors();
            since = transport::now();
          }
          return transport::now() - since > std::chrono::milliseconds(200);
        },
        2 * kPatience))
        << "the motors never stand still";
    return cell_->motors();
  }
  /// Reads, and writes in cycles, until the session is over; how long that took.
  std::optional<Duration> time_to_loss(HandAction action) {
    const TimePoint start = transport::now();
    TimePoint next = start;
    while (transport::now() < start + kPatience) {
      if (transport::now() >= next) {
        next = transport::now() + std::chrono::milliseconds(20);
        const HandCommand command = action == HandAction::kMove ? move(cell_->far_rad) : plain(action);
        if (hand_->write(command, transport::now()) == IoStatus::kDisconnected) return transport::now() - start;
      }
      if (turn() == IoStatus::kDisconnected) return transport::now() - start;
    }
    return std::nullopt;
  }

  std::unique_ptr<HandCell> cell_;
  std::unique_ptr<HandDriver> hand_;
  HandInfo info_;
  HandDeviceState state_;
  IoStatus last_write_{IoStatus::kEmpty};
};

}  // namespace embody::test
