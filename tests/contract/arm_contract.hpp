#pragma once
// One session of an arm driver, as the arm loop would run it, for the laws that all of them obey.
#include <optional>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "tests/contract/arm_cell.hpp"

namespace embody::test {

struct ArmKind {
  const char* name;
  std::unique_ptr<ArmCell> (*make)();
};
inline void PrintTo(const ArmKind& kind, std::ostream* out) {
  *out << kind.name;
}

class ArmContract : public ::testing::TestWithParam<ArmKind> {
 protected:
  void SetUp() override { cell_ = GetParam().make(); }

  void open(Pace pace = Pace::kPatient) {
    arm_ = cell_->driver(pace);
    ASSERT_NO_FATAL_FAILURE(connect());
  }
  void connect() {
    const auto connected = arm_->connect();
    ASSERT_TRUE(connected.ok()) << connected.error().detail.view();
    info_ = *connected;
  }
  [[nodiscard]] Status try_to_connect() {
    const auto connected = arm_->connect();
    if (!connected) return connected.error();
    info_ = *connected;
    return {};
  }

  ArmCommand command(ArmAction action, const Vector6& q_rad = Vector6::Zero(),
                     const Vector6& qd_rad_s = Vector6::Zero()) {
    ArmCommand made;
    made.sequence = ++sequence_;
    made.action = action;
    made.q_rad = q_rad;
    made.qd_rad_s = qd_rad_s;
    made.t_expires = transport::now() + std::chrono::milliseconds(500);
    return made;
  }
  IoStatus send(ArmAction action, const Vector6& q_rad = Vector6::Zero(), const Vector6& qd_rad_s = Vector6::Zero()) {
    return arm_->write(command(action, q_rad, qd_rad_s), transport::now());
  }

  /// Waits for the line, at most 20 ms, then reads.
  IoStatus turn() {
    static_cast<void>(transport::wait_readable(info_.fd, transport::now() + std::chrono::milliseconds(20)));
    return arm_->read(state_);
  }
  /// Answers each state with what `act` does, until `done`; false after `limit` or when the session has ended.
  bool run(const std::function<void()>& act, const std::function<bool()>& done, Duration limit = kPatience) {
    const TimePoint end = transport::now() + limit;
    while (!done()) {
      if (transport::now() >= end) return false;
      const IoStatus status = turn();
      if (status == IoStatus::kDisconnected) return done();
      if (status == IoStatus::kDone) act();
    }
    return true;
  }
  bool hold_for(Duration span) {
    run([&] { send(ArmAction::kHold); }, [] { return false; }, span);
    return arm_->reason().empty();
  }
  /// Holds until the program listens, then tracks the joints where they are.
  bool engage() {
    if (!run([&] { send(ArmAction::kHold); }, [&] { return sequence_ > 5 && state_.echo_sequence + 5 > sequence_; })) {
      return false;
    }
    const Vector6 q_rad = state_.q_rad;
    return run([&] { send(ArmAction::kTrack, q_rad); }, [&] { return state_.tracking; });
  }
  /// Sends joint 0 away at kContractSpeed_rad_s until it really moves.
  bool set_out() {
    if (!engage()) return false;
    const Vector6 start = state_.q_rad;
    const TimePoint t0 = transport::now();
    const auto go = [&] {
      Vector6 q_rad = start, qd_rad_s = Vector6::Zero();
      qd_rad_s[0] = kContractSpeed_rad_s;
      q_rad[0] += kContractSpeed_rad_s * to_seconds(transport::now() - t0);
      send(ArmAction::kTrack, q_rad, qd_rad_s);
    };
    return run(go, [&] { return cell_->record().qd_rad_s[0] > 0.8 * kContractSpeed_rad_s; });
  }
  [[nodiscard]] bool stands_still() const { return cell_->record().qd_rad_s.cwiseAbs().maxCoeff() < 0.01; }
  [[nodiscard]] bool is_at(const Vector6& q_rad) const {
    return (cell_->record().q_rad - q_rad).cwiseAbs().maxCoeff() < 2e-3;
  }
  /// Waits, without the driver, until the arm has stood still for 200 ms.
  Vector6 rest() {
    TimePoint since = transport::now();
    EXPECT_TRUE(eventually([&] {
      if (!stands_still()) since = transport::now();
      return transport::now() - since > std::chrono::milliseconds(200);
    })) << "the arm never stands still";
    return cell_->record().q_rad;
  }
  /// Reads, and writes for every state or 20 ms, until the session is over; how long that took.
  std::optional<Duration> time_to_loss() {
    const TimePoint start = transport::now();
    while (transport::now() < start + kPatience) {
      if (turn() == IoStatus::kDisconnected) return transport::now() - start;
      if (send(ArmAction::kHold) == IoStatus::kDisconnected) return transport::now() - start;
    }
    return std::nullopt;
  }

  std::unique_ptr<ArmCell> cell_;
  std::unique_ptr<ArmDriver> arm_;
  ArmInfo info_;
  ArmState state_;
  std::uint32_t sequence_{0};
};

}  // namespace embody::test
