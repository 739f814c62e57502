#pragma once
// The loop that a daemon would run around the arm driver, for tests.
#include <memory>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/ur_rtde/ur_rtde_arm.hpp"

namespace embody::test {

inline constexpr Duration kPatience = std::chrono::seconds(5);

/// An arm driver with the loop that a daemon would run around it: one command per package.
class ArmLoop {
 public:
  explicit ArmLoop(const UrRtdeConfig& config) : arm(std::make_unique<UrRtdeArm>(config)) { connect(); }
  explicit ArmLoop(std::uint16_t port, Duration in_use_patience = std::chrono::seconds(4))
      : ArmLoop(without_upload(port, in_use_patience)) {}

  static UrRtdeConfig without_upload(std::uint16_t port, Duration in_use_patience) {
    UrRtdeConfig config;
    config.port = port;
    config.in_use_patience = in_use_patience;
    config.upload = false;
    config.stale_after = kPatience;  // a busy host must not end the sessions of other tests
    return config;
  }
  bool connect() {
    const auto info = arm->connect();
    connected = info.ok();
    fd = info ? info->fd : -1;
    if (!info) error = info.error();
    return connected;
  }
  /// Waits for the next package; false when the session is over or nothing comes.
  bool next() {
    const TimePoint deadline = transport::now() + kPatience;
    while (true) {
      const IoStatus status = arm->read(state);
      if (status == IoStatus::kDone) return true;
      if (status == IoStatus::kDisconnected || !transport::wait_readable(fd, deadline)) return false;
    }
  }
  IoStatus send(ArmAction action, const Vector6& q = Vector6::Zero(), const Vector6& qd = Vector6::Zero()) {
    ArmCommand command;
    command.sequence = ++sequence;
    command.action = action;
    command.q_rad = q;
    command.qd_rad_s = qd;
    command.t_expires = transport::now() + std::chrono::milliseconds(50);
    return arm->write(command, transport::now());
  }
  /// Sends one command per package until `done` holds for the newest state.
  template <class Done>
  bool send_until(ArmAction action, const Vector6& q, Done done) {
    const TimePoint deadline = transport::now() + kPatience;
    while (transport::now() < deadline && next()) {
      if (done(state)) return true;
      send(action, q);
    }
    return false;
  }
  /// Hold, then track the present position.
  bool engage() {
    if (send(ArmAction::kHold) != IoStatus::kDone) return false;
    const auto seen = [this](const ArmState& s) { return s.echo_sequence == sequence; };
    if (!send_until(ArmAction::kHold, Vector6::Zero(), seen)) return false;
    return send_until(ArmAction::kTrack, state.q_rad, [](const ArmState& s) { return s.tracking; });
  }

  std::unique_ptr<UrRtdeArm> arm;
  ArmState state;
  int fd{-1};
  std::uint32_t sequence{0};
  bool connected{false};
  Error error;
};

}  // namespace embody::test
