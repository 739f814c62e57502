#include "drivers/mia/compact/mia_can_hand.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/mia/telemetry.hpp"
#include "drivers/transport/clock.hpp"

namespace embody::mia::compact {
namespace {

constexpr Duration kRefresh = std::chrono::milliseconds(900);  ///< a motor hears its target at least once a second
constexpr int kFramesPerCall = 128;                            ///< what the hand says in about 0.3 s

constexpr std::size_t at(Motor motor) noexcept {
  return static_cast<std::size_t>(motor);
}

}  // namespace

MiaCanHand::MiaCanHand(CompactConfig config) : config_(std::move(config)) {
  show({{"commands", &counters_.commands},
        {"replies", &counters_.replies},
        {"timeouts", &counters_.timeouts},
        {"refusals", &counters_.refusals},
        {"stray_acks", &counters_.stray_acks},
        {"no_room", &counters_.no_room},
        {"damaged", &counters_.damaged},
        {"lost_states", &counters_.lost_states},
        {"stops", &counters_.stops},
        {"under_voltages", &counters_.under_voltages},
        {"error_frames", &counters_.error_frames},
        {"bus_offs", &counters_.bus_offs}});
}

MiaCanHand::~MiaCanHand() {
  end_session();
}

/// Adds what the parts of the connection count by themselves.
void MiaCanHand::count_parts() noexcept {
  counters_.lost_states = states_.lost();
  counters_.repeated_states = states_.repeated();
  if (!bus_) return;
  counters_.error_frames = error_frames_before_ + bus_->counters().error_frames;
  counters_.bus_offs = bus_offs_before_ + bus_->counters().bus_offs;
}

transport::CanCounters MiaCanHand::bus_counters() const noexcept {
  return bus_ ? bus_->counters() : bus_counters_;
}

std::array<std::uint16_t, kMotors> MiaCanHand::currents() const noexcept {
  std::array<std::uint16_t, kMotors> currents{};
  for (std::size_t i = 0; i < kMotors; ++i) currents[i] = states_.state(i).current;
  return currents;
}

double MiaCanHand::thumb_opposition() const noexcept {
  return thumb_opposition_rad(index_delta_rad(config_.transmission.index, states_.counts()[at(Motor::kIndex)]));
}

IoStatus MiaCanHand::read(HandDeviceState& state) noexcept {
  if (lost_) return IoStatus::kDisconnected;
  pump();
  if (lost_) return IoStatus::kDisconnected;
  if (!states_.complete()) return IoStatus::kEmpty;
  state.t_arrival = states_.take_set();
  ++counters_.replies;
  state.reply = counters_.replies;
  state.joint_count = kMotors;
  const auto q_rad = joint_angles_rad(config_.transmission, states_.counts());
  std::copy(q_rad.begin(), q_rad.end(), state.q_rad.begin());
  tell(state.t_arrival, state.telemetry);
  return IoStatus::kDone;
}

/// Hands that report a low supply, a missed heartbeat or lost positions have ended the session: here all is well.
void MiaCanHand::tell(TimePoint now, HandTelemetry& telemetry) const noexcept {
  telemetry = {};
  telemetry.supply = HandSupply::kGood;
  telemetry.t_current = now;
  telemetry.current_count = kMotors;
  bool blocked = false;
  for (std::size_t i = 0; i < kMotors; ++i) {
    telemetry.current_raw[i] = states_.state(i).current;
    blocked = blocked || (states_.state(i).flags & kBlocked) != 0;
  }
  const bool has_forces = t_forces_ != TimePoint{} && now - t_forces_ <= TelemetryReader::kFresh;
  if (has_forces) {
    std::array<int, kStrainFields> strain{};
    std::copy(forces_.raw.begin(), forces_.raw.end(), strain.begin());
    tell_forces(forces_of(strain, TelemetryConfig{}.strain_fields), t_forces_, telemetry);
  }
  if (!stop_.may_resume()) {
    telemetry.condition = HandCondition::kStopped;
    telemetry.why_not = "the hand was stopped: hold first";
  } else if (blocked) {
    telemetry.condition = HandCondition::kHoldsObject;
  } else {
    telemetry.condition = HandCondition::kReady;
  }
}

IoStatus MiaCanHand::write(const HandCommand& command, TimePoint now) noexcept {
  if (lost_) return IoStatus::kDisconnected;
  moving_allowed_ = false;
  switch (command.action) {
    case HandAction::kMove:
      if (!may_move(command, now)) return IoStatus::kRefused;
      if (stop_.latched()) stop_.resume();
      moving_allowed_ = true;
      move(command, now);
      break;
    case HandAction::kHold:
      stop_.hold();
      break;
    case HandAction::kStop:
      request_stop();
      break;
  }
  pump();
  return lost_ ? IoStatus::kDisconnected : IoStatus::kDone;
}

bool MiaCanHand::may_move(const HandCommand& command, TimePoint now) const noexcept {
  if (now > command.t_expires || command.joint_count != kMotors || !stop_.may_resume()) return false;
  return std::all_of(command.q_rad.begin(), command.q_rad.begin() + kMotors, [](double q) { return std::isfinite(q); });
}

void MiaCanHand::move(const HandCommand& command, TimePoint now) noexcept {
  std::array<double, kMotors> q_rad{};
  for (std::size_t i = 0; i < kMotors; ++i) {
    q_rad[i] = std::clamp(command.q_rad[i], config_.min_rad[i], config_.max_rad[i]);
  }
  const auto exact = motor_counts(config_.transmission, q_rad);
  for (std::size_t i = 0; i < kMotors && !lost_; ++i) {
    const double lowest = i == at(Motor::kIndex) ? -kMaxCounts : 0;
    const auto counts = static_cast<std::int16_t>(std::lround(std::clamp<double>(exact[i], lowest, kMaxCounts)));
    const Exchange& exchange = exchanges_[i];
    if (exchange.waiting && exchange.command.opcode == Opcode::kPosition && exchange.command.value == counts) continue;
    if (!exchange.waiting && told_[i].known && told_[i].counts == counts && now - told_[i].when < kRefresh) continue;
    told_[i].known = false;  // until the acknowledgement: the hand may or may not have heard it
    transmit({Opcode::kPosition, static_cast<std::uint8_t>(i), counts, static_cast<std::uint8_t>(config_.speed_percent),
              static_cast<std::uint8_t>(config_.current_percent)},
             now);
  }
}

void MiaCanHand::request_stop() noexcept {
  for (Exchange& exchange : exchanges_) {
    if (exchange.command.opcode == Opcode::kPosition) exchange.waiting = false;
  }
  for (Told& told : told_) told.known = false;
  if (stop_.request()) ++counters_.stops;
}

void MiaCanHand::send_stop(TimePoint now) noexcept {
  if (!stop_.busy() || exchanges_[stop_.target()].waiting) return;
  if (transmit({Opcode::kStop, stop_.target()}, now) != IoStatus::kEmpty) return;
  // No room: as if it had been sent and lost, so that the next try comes when there may be room again.
  exchanges_[stop_.target()] = {true, {Opcode::kStop, stop_.target()}, now + config_.ack_timeout};
}

IoStatus MiaCanHand::transmit(Command command, TimePoint now) noexcept {
  command.counter = next_counter_[command.motor];
  const IoStatus status = bus_->send(encode(config_.ids, command));
  if (status == IoStatus::kDone) {
    ++next_counter_[command.motor];
    ++counters_.commands;
    exchanges_[command.motor] = {true, command, now + config_.ack_timeout};
  } else if (status == IoStatus::kEmpty) {
    ++counters_.no_room;
  } else {
    bus_gone_ = true;
    lose(bus_->reason());
  }
  return status;
}

void MiaCanHand::pump() noexcept {
  bool drained = false;
  for (int i = 0; i < kFramesPerCall && !drained && !lost_; ++i) {
    CanFrame frame;
    const IoStatus status = bus_->receive(frame);
    if (status == IoStatus::kDisconnected) {
      bus_gone_ = true;
      lose(bus_->reason());
    } else if (status != IoStatus::kDone) {
      drained = true;
    } else if (!take_frame(frame)) {
      ++counters_.damaged;
    }
  }
  if (!lost_) check_times(transport::now(), drained);
  count_parts();
}

/// False for a frame that is not what its identifier promises.
bool MiaCanHand::take_frame(const CanFrame& frame) noexcept {
  std::size_t motor = 0;
  State state;
  Verdict verdict = decode(config_.ids, frame, motor, state);
  if (verdict == Verdict::kGood) take_state(motor, state, frame.t_arrival);
  if (verdict != Verdict::kForeign) return verdict == Verdict::kGood;
  Ack ack;
  verdict = decode(config_.ids, frame, ack);
  if (verdict == Verdict::kGood) take_ack(ack);
  if (verdict != Verdict::kForeign) return verdict == Verdict::kGood;
  verdict = decode(config_.ids, frame, forces_);
  if (verdict == Verdict::kGood) t_forces_ = frame.t_arrival;
  return verdict == Verdict::kGood;
}

void MiaCanHand::take_state(std::size_t motor, const State& state, TimePoint t) noexcept {
  states_.take(motor, state, t);
  if ((state.flags & kUnderVoltage) != 0) {
    if (!lost_) ++counters_.under_voltages;
    lose("the hand reports under-voltage: check its supply");
  } else if ((state.flags & kHeartbeatLost) != 0) {
    lose("the hand stopped by itself: it missed our heartbeat");
  } else if ((state.flags & kCalibrated) == 0) {
    lose("the hand has lost its positions (restarted?): calibrate it before it is used again");
  }
}

void MiaCanHand::take_ack(const Ack& ack) noexcept {
  Exchange& exchange = exchanges_[ack.motor];
  if (!exchange.waiting || exchange.command.opcode != ack.opcode || exchange.command.counter != ack.counter) {
    ++counters_.stray_acks;
    return;
  }
  exchange.waiting = false;
  const bool done = ack.status == AckStatus::kDone;
  ++(done ? counters_.acks : counters_.refusals);
  if (ack.opcode == Opcode::kStop) {
    if (stop_.busy() && stop_.target() == ack.motor) stop_.finish(done);
  } else if (ack.opcode == Opcode::kPosition && done && !stop_.latched()) {
    told_[ack.motor] = {true, exchange.command.value, exchange.deadline - config_.ack_timeout};
  }
  if (done) {
    failures_in_a_row_ = 0;
  } else if (ack.status == AckStatus::kStopped) {
    lose("the hand stopped by itself: it missed our heartbeat");
  } else if (++failures_in_a_row_ >= config_.lost_after_timeouts) {
    lose("the hand refuses our commands: is it calibrated?");
  }
}

void MiaCanHand::check_times(TimePoint now, bool drained) noexcept {
  for (Exchange& exchange : exchanges_) {
    if (exchange.waiting && now >= exchange.deadline) take_timeout(exchange);
  }
  send_stop(now);
  if (!lost_) beat(now);
  // A stop is tried to its end: the hand may hear us although we do not hear the hand.
  if (lost_ || stop_.busy()) return;
  if (failures_in_a_row_ >= config_.lost_after_timeouts) {
    lose("the hand no longer acknowledges commands; has it power?");
  } else if (drained && states_.silent(now, config_.state_timeout)) {
    lose("the hand's cyclic states stay away or do not move on; has it power?");
  }
}

void MiaCanHand::take_timeout(Exchange& exchange) noexcept {
  exchange.waiting = false;
  ++counters_.timeouts;
  ++failures_in_a_row_;
  if (exchange.command.opcode == Opcode::kStop && stop_.busy() && stop_.target() == exchange.command.motor) {
    stop_.finish(false);
  }
}

void MiaCanHand::beat(TimePoint now) noexcept {
  if (now < next_heartbeat_) return;
  const IoStatus status = bus_->send(encode(config_.ids, Heartbeat{moving_allowed_, heartbeat_counter_}));
  if (status == IoStatus::kDisconnected) {
    bus_gone_ = true;
    return lose(bus_->reason());
  }
  if (status == IoStatus::kEmpty) {
    ++counters_.no_room;
    return;
  }
  ++heartbeat_counter_;
  ++counters_.heartbeats;
  next_heartbeat_ = std::max(next_heartbeat_ + config_.heartbeat_period, now);  // none to make up for
}

void MiaCanHand::lose(std::string_view why) noexcept {
  if (lost_) return;
  lost_ = true;
  reason_ = why;
}

}  // namespace embody::mia::compact
