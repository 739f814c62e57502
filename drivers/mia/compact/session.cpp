// Begin and end of a session with a Mia hand on CAN: the part that may wait.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "drivers/mia/can_line.hpp"
#include "drivers/mia/compact/mia_can_hand.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::mia::compact {
namespace {

constexpr Duration kProbeTime = std::chrono::milliseconds(1800);  ///< a hand may still be starting
constexpr Duration kProbeStep = std::chrono::milliseconds(150);
constexpr Duration kStatesTime = std::chrono::milliseconds(500);
constexpr Duration kGoodbyeTime = std::chrono::milliseconds(250);

bool within(double value, double least, double most) noexcept {
  return value >= least && value <= most;  // false for not-a-number
}

Status check_config(const CompactConfig& config) {
  if (const Status transmission = check(config.transmission); !transmission) return transmission;
  if (!config.ids.base.valid() || !config.ids.at(kLastId).valid()) {
    return make_error(Errc::kInvalidArgument, "mia: CAN identifiers 0x%x to 0x%x do not fit %d bits",
                      config.ids.base.value, config.ids.base.value + kLastId, config.ids.base.extended ? 29 : 11);
  }
  for (std::size_t i = 0; i < kMotors; ++i) {
    if (std::isfinite(config.min_rad[i]) && std::isfinite(config.max_rad[i]) && config.min_rad[i] <= config.max_rad[i])
      continue;
    return make_error(Errc::kInvalidArgument, "mia: the limits of %s are not a range", kJointNames[i]);
  }
  if (!within(config.speed_percent, 1, 99) || !within(config.current_percent, 0, 80)) {
    return make_error(Errc::kInvalidArgument, "mia: speed_percent must be 1..99 and current_percent 0..80");
  }
  if (!within(config.state_rate_hz, 10, 500) || !within(config.command_rate_hz, 1, 200) ||
      !within(config.forces_every, 0, 100)) {
    return make_error(Errc::kInvalidArgument,
                      "mia: state_rate_hz must be 10..500, command_rate_hz 1..200 and forces_every 0..100");
  }
  if (config.ack_timeout <= Duration::zero() || config.state_timeout <= Duration::zero() ||
      config.heartbeat_period <= Duration::zero() || config.lost_after_timeouts < 1) {
    return make_error(Errc::kInvalidArgument, "mia: CAN time-outs and lost_after_timeouts must be positive");
  }
  return {};
}

std::vector<CanId> received_ids(const Ids& ids) {
  std::vector<CanId> wanted{ids.at(kForcesId), ids.at(kAckId)};
  for (std::uint32_t i = 0; i < kMotors; ++i) wanted.push_back(ids.at(kStateId + i));
  return wanted;
}

}  // namespace

Result<HandInfo> MiaCanHand::connect() {
  end_session();
  if (const Status usable = check_config(config_); !usable) return usable.error();
  auto bus = transport::open_can({config_.interface, received_ids(config_.ids), config_.local_loopback});
  if (!bus) return bus.error();
  bus_.emplace(std::move(*bus));
  error_frames_before_ = counters_.error_frames;
  bus_offs_before_ = counters_.bus_offs;
  t_forces_ = {};
  exchanges_ = {};
  told_ = {};
  stop_ = {};
  failures_in_a_row_ = 0;
  moving_allowed_ = false;
  reason_ = {};
  lost_ = bus_gone_ = false;
  states_.reset(transport::now());
  if (const Status started = start(transport::now() + kProbeTime); !started) {
    lost_ = bus_gone_ = true;  // nothing was moved: nothing to stop
    reason_ = {};
    count_parts();
    bus_counters_ = bus_->counters();
    bus_.reset();
    return started.error();
  }
  failures_in_a_row_ = 0;
  HandInfo info;
  info.fd = bus_->fd();
  info.rate_hz = config_.command_rate_hz;
  info.joint_count = kMotors;
  for (std::size_t i = 0; i < kMotors; ++i) info.joint_names[i] = kJointNames[i];
  std::array<char, 121> peer{};
  std::snprintf(peer.data(), peer.size(), "Mia hand, %.90s, at %s", kCanProfileNotice.data(),
                config_.interface.c_str());
  info.peer = peer.data();
  return info;
}

Status MiaCanHand::start(TimePoint deadline) {
  if (const Status answered = ask(Opcode::kPing, 0, 0, deadline); !answered) return answered;
  next_heartbeat_ = transport::now();
  beat(next_heartbeat_);
  const auto forces = static_cast<std::uint8_t>(config_.forces_every);
  const auto rate_hz = static_cast<std::int16_t>(config_.state_rate_hz);
  if (const Status streaming = ask(Opcode::kStream, rate_hz, forces, deadline); !streaming) return streaming;
  return await_states(transport::now() + kStatesTime);
}

/// Sends a command to the whole hand until it is acknowledged. States on the way are not judged: they may be old.
Status MiaCanHand::ask(Opcode opcode, std::int16_t value, std::uint8_t speed_percent, TimePoint deadline) {
  const char* where = config_.interface.c_str();
  while (transport::now() < deadline) {
    const TimePoint until = std::min(deadline, transport::now() + kProbeStep);
    if (opcode != Opcode::kPing) beat(transport::now());
    const IoStatus sent = transmit({opcode, kAllMotors, value, speed_percent}, transport::now());
    if (sent == IoStatus::kDisconnected) return make_error(Errc::kDisconnected, "%s", bus_->reason().data());
    while (transport::wait_readable(bus_->fd(), until)) {
      CanFrame frame;
      const IoStatus status = bus_->receive(frame);
      if (status == IoStatus::kDisconnected) return make_error(Errc::kDisconnected, "%s", bus_->reason().data());
      Ack ack;
      if (status != IoStatus::kDone || decode(config_.ids, frame, ack) != Verdict::kGood) continue;
      if (ack.opcode != opcode || ack.counter != exchanges_[kAllMotors].command.counter) continue;
      exchanges_[kAllMotors].waiting = false;
      if (ack.status == AckStatus::kDone) return {};
      return make_error(Errc::kRefused, "the hand at %s refuses to begin: does it speak this version of our profile?",
                        where);
    }
  }
  const auto& bus = bus_->counters();
  return make_error(Errc::kTimeout, "no Mia hand or gateway answers at %s%s: check power, bit rate and identifiers",
                    where, bus.no_acks > 0 || bus.queue_full > 0 ? " (nobody on the bus acknowledges frames)" : "");
}

/// Until every motor has told its state; the hand's flags are judged as in a session.
Status MiaCanHand::await_states(TimePoint deadline) {
  states_.reset(transport::now());
  while (!lost_ && !states_.complete() && transport::now() < deadline) {
    beat(transport::now());
    if (!transport::wait_readable(bus_->fd(), std::min(deadline, next_heartbeat_))) continue;
    CanFrame frame;
    const IoStatus status = bus_->receive(frame);
    if (status == IoStatus::kDisconnected) lose(bus_->reason());
    if (status == IoStatus::kDone && !take_frame(frame)) ++counters_.damaged;
  }
  if (lost_) return make_error(Errc::kRefused, "%s", reason_.c_str());
  if (states_.complete()) return {};
  return make_error(Errc::kTimeout, "the hand at %s answers but does not send the states of all motors",
                    config_.interface.c_str());
}

void MiaCanHand::end_session() noexcept {
  if (bus_ && !bus_gone_) {
    const FixedString<240> why = reason_;
    moving_allowed_ = lost_ = false;
    stop_.forget();  // say it again, whatever was said before
    request_stop();
    const TimePoint deadline = transport::now() + kGoodbyeTime;
    while (stop_.busy() && !bus_gone_ && transport::now() < deadline) {
      pump();
      if (bus_gone_) break;
      lost_ = false;  // complaints about the hand do not keep us from stopping it
      check_times(transport::now(), false);
      if (!stop_.busy() || bus_gone_) break;
      static_cast<void>(transport::wait_readable(bus_->fd(), std::min(deadline, exchanges_[stop_.target()].deadline)));
    }
    reason_ = why;
  }
  count_parts();
  if (bus_) bus_counters_ = bus_->counters();
  bus_.reset();
  lost_ = bus_gone_ = true;
}

}  // namespace embody::mia::compact
