#include "drivers/sim/mia/can_compact_hand.hpp"

#include <algorithm>
#include <cmath>

namespace embody::sim {
namespace {

using mia::kMotors;
using mia::compact::Ack;
using mia::compact::AckStatus;
using mia::compact::Command;
using mia::compact::Opcode;
using mia::compact::Verdict;

constexpr std::size_t kMaxPending = 32;
// Raw readings of one published hand at rest: MRL tangential, index normal and tangential, thumb tangential and normal,
// MRL normal.
constexpr std::array<std::uint16_t, mia::compact::kStrainGauges> kIdleStrain{260, 208, 208, 215, 215, 260};
// Motor currents are not documented; these only tell standing, moving and blocked apart.
constexpr std::uint16_t kStandingCurrent = 20;
constexpr std::uint16_t kMovingCurrent = 120;
constexpr std::uint16_t kBlockedCurrent = 512;

bool consume(unsigned& left) noexcept {
  if (left == 0) return false;
  --left;
  return true;
}

}  // namespace

CompactHand::CompactHand(const CompactHandConfig& config, TimePoint now) : config_(config), now_(now) {
  for (std::size_t i = 0; i < kMotors; ++i) {
    motors_[i] = MiaMotor(static_cast<mia::Motor>(i), config.start_counts[i], config.lag_s);
  }
}

void CompactHand::receive(const CanFrame& frame, TimePoint now) {
  move_to(now);
  mia::compact::Heartbeat heartbeat;
  Verdict verdict = decode(config_.ids, frame, heartbeat);
  if (verdict == Verdict::kGood) {
    ++counters_.heartbeats;
    if (heartbeat_due_) heartbeat_due_ = now_ + config_.heartbeat_timeout;
  }
  Command command;
  if (verdict == Verdict::kForeign) verdict = decode(config_.ids, frame, command);
  if (verdict == Verdict::kDamaged) ++counters_.damaged;
  if (verdict != Verdict::kGood || frame.id == config_.ids.at(mia::compact::kHeartbeatId)) return;
  ++counters_.commands;
  auto& last = last_counter_[command.motor];
  if (last == command.counter && command.opcode != Opcode::kPing) {
    ++counters_.repeated;
    return;
  }
  last = command.counter;
  const AckStatus status = execute(command);
  if (status != AckStatus::kDone) ++counters_.refused;
  if (pending_.size() >= kMaxPending) return;
  pending_.push_back({now_ + config_.ack_delay, {command.opcode, command.motor, status, command.counter}});
}

AckStatus CompactHand::execute(const Command& command) {
  const bool whole = command.motor == mia::compact::kAllMotors;
  switch (command.opcode) {
    case Opcode::kStop:
      ++counters_.stops;
      halt(command.motor);
      return AckStatus::kDone;
    case Opcode::kPosition:
    case Opcode::kSpeed:
      return whole ? AckStatus::kUnknown : drive(command);
    case Opcode::kCalibrate:
      calibrated_ = calibrated_ || whole;
      return whole ? AckStatus::kDone : AckStatus::kUnknown;
    case Opcode::kPing:
      if (!whole) return AckStatus::kUnknown;
      heartbeat_lost_ = false;
      heartbeat_due_ = now_ + config_.heartbeat_timeout;
      return AckStatus::kDone;
    case Opcode::kStream:
      if (!whole) return AckStatus::kUnknown;
      if (command.value < 0 || command.value > 1000) return AckStatus::kOutOfRange;
      state_period_.reset();
      if (command.value > 0) state_period_ = from_seconds(1.0 / command.value);
      next_state_ = now_;
      forces_every_ = command.speed_percent;
      return AckStatus::kDone;
    case Opcode::kJointPosition:
    case Opcode::kJointSpeed:
    case Opcode::kGrasp:
      return AckStatus::kUnknown;  // this gateway knows motors only
  }
  return AckStatus::kUnknown;
}

AckStatus CompactHand::drive(const Command& command) {
  if (heartbeat_lost_) return AckStatus::kStopped;
  if (!calibrated_) return AckStatus::kUncalibrated;
  const auto motor = static_cast<mia::Motor>(command.motor);
  const bool position = command.opcode == Opcode::kPosition;
  const int least = position && motor != mia::Motor::kIndex ? 0 : -mia::kMaxCounts;
  if (command.value < least || command.value > mia::kMaxCounts) return AckStatus::kOutOfRange;
  ++counters_.motions;
  if (position) {
    motors_[command.motor].move_to(command.value, command.speed_percent);
  } else {
    motors_[command.motor].drive(command.value);
  }
  return AckStatus::kDone;
}

void CompactHand::halt(std::uint8_t motor) noexcept {
  for (std::size_t i = 0; i < kMotors; ++i) {
    if (motor == i || motor == mia::compact::kAllMotors) motors_[i].halt();
  }
}

void CompactHand::restart() {
  halt(mia::compact::kAllMotors);
  pending_.clear();
  state_period_.reset();
  heartbeat_due_.reset();
  last_counter_ = {};
  heartbeat_lost_ = calibrated_ = false;
}

std::optional<TimePoint> CompactHand::next_event() const noexcept {
  std::optional<TimePoint> next;
  const auto consider = [&next](TimePoint t) { next = next ? std::min(*next, t) : t; };
  if (!pending_.empty()) consider(pending_.front().due);
  if (state_period_) consider(next_state_);
  if (heartbeat_due_) consider(*heartbeat_due_);
  return next;
}

std::vector<transport::CanFrame> CompactHand::advance(TimePoint now) {
  std::vector<CanFrame> out;
  while (true) {
    const auto event = next_event();
    if (!event || *event > now) break;
    move_to(*event);
    if (heartbeat_due_ && *heartbeat_due_ <= now_) {
      heartbeat_due_.reset();
      heartbeat_lost_ = true;
      ++counters_.heartbeat_stops;
      halt(mia::compact::kAllMotors);
    } else if (!pending_.empty() && pending_.front().due <= now_) {
      say_ack(pending_.front().ack, out);
      pending_.pop_front();
    } else {
      say_states(out);
      // States do not catch up on what they missed.
      next_state_ = std::max(next_state_ + *state_period_, now - *state_period_);
    }
  }
  move_to(now);
  return out;
}

void CompactHand::move_to(TimePoint now) noexcept {
  now = std::max(now, now_);
  for (MiaMotor& motor : motors_) motor.advance(to_seconds(now - now_));
  now_ = now;
}

void CompactHand::say_ack(const Ack& ack, std::vector<CanFrame>& out) {
  if (silent_ || consume(drop_acks_)) return;
  out.push_back(encode(config_.ids, ack));
  if (consume(broken_crcs_)) out.back().data[7] ^= 0x55;
}

void CompactHand::say_states(std::vector<CanFrame>& out) {
  if (!stuck_) ++state_counter_;
  if (silent_) return;
  for (std::size_t i = 0; i < kMotors; ++i) {
    if (mute_motor_[i] || consume(drop_states_)) continue;
    const MiaMotor& motor = motors_[i];
    const bool moving = std::abs(motor.speed()) >= 0.5;
    mia::compact::State state;
    state.counts = static_cast<std::int16_t>(std::lround(motor.counts()));
    state.speed = static_cast<std::int16_t>(std::lround(motor.speed()));
    state.current = motor.blocked() ? kBlockedCurrent : moving ? kMovingCurrent : kStandingCurrent;
    const auto flag = [](bool on, std::uint8_t bit) { return on ? bit : std::uint8_t{0}; };
    state.flags = static_cast<std::uint8_t>(
        flag(moving, mia::compact::kMoving) | flag(motor.blocked(), mia::compact::kBlocked) |
        flag(calibrated_, mia::compact::kCalibrated) | flag(heartbeat_lost_, mia::compact::kHeartbeatLost) |
        flag(under_voltage_, mia::compact::kUnderVoltage));
    state.counter = state_counter_;
    out.push_back(encode(config_.ids, i, state));
    if (consume(garbled_)) out.back().size = 5;
  }
  if (forces_every_ == 0 || ++states_said_ % forces_every_ != 0) return;
  out.push_back(encode(config_.ids, mia::compact::Forces{kIdleStrain, forces_counter_}));
  forces_counter_ = (forces_counter_ + 1) & 0xF;
}

std::array<double, kMotors> CompactHand::motor_counts() const noexcept {
  return {motors_[0].counts(), motors_[1].counts(), motors_[2].counts()};
}

}  // namespace embody::sim
