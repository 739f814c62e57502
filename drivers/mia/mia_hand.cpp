#include "drivers/mia/mia_hand.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/mia/serial_line.hpp"
#include "drivers/transport/clock.hpp"

namespace embody::mia {
namespace {

constexpr std::size_t kReadSlot = kMotors;
constexpr std::size_t kSlots = kMotors + 1;
constexpr Duration kRefresh = std::chrono::milliseconds(900);  ///< a motor hears its target at least once a second
constexpr int kStopTries = 4;
constexpr int kZeroSpeedCurrent_percent = 50;
constexpr int kLinesPerCall = 64;  ///< far more than the line carries in 20 ms

constexpr std::size_t at(Motor motor) noexcept {
  return static_cast<std::size_t>(motor);
}

}  // namespace

MiaHand::MiaHand(MiaConfig config) : config_(std::move(config)), open_(serial_line(config_.device)) {}

MiaHand::MiaHand(MiaConfig config, OpenLine open) : config_(std::move(config)), open_(std::move(open)) {}

MiaHand::~MiaHand() {
  end_session();
}

double MiaHand::thumb_opposition() const noexcept {
  return thumb_opposition_rad(index_delta_rad(config_.transmission.index, reply_.counts[at(Motor::kIndex)]));
}

void MiaHand::hang_up() noexcept {
  lost_ = hung_up_ = true;
  reason_ = "the serial device is gone; is it unplugged?";
}

IoStatus MiaHand::read(HandDeviceState& state) noexcept {
  if (lost_) return IoStatus::kDisconnected;
  pump();
  if (lost_) return IoStatus::kDisconnected;
  if (!reply_.ready) return IoStatus::kEmpty;
  reply_.ready = false;
  state.reply = reply_.number;
  state.t_arrival = reply_.t_arrival;
  state.joint_count = kMotors;
  const auto q_rad = joint_angles_rad(config_.transmission, reply_.counts);
  std::copy(q_rad.begin(), q_rad.end(), state.q_rad.begin());
  return IoStatus::kDone;
}

IoStatus MiaHand::write(const HandCommand& command, TimePoint now) noexcept {
  if (lost_) return IoStatus::kDisconnected;
  switch (command.action) {
    case HandAction::kMove:
      if (!may_move(command, now)) {
        drop_motion();
        return IoStatus::kRefused;
      }
      if (stop_.latched) stop_ = {};
      queue_move(command, now);
      break;
    case HandAction::kHold:
      drop_motion();
      stop_.hold_seen = stop_.latched;
      break;
    case HandAction::kStop:
      request_stop();
      break;
  }
  cycle_.read_pending = true;
  const TimePoint t = transport::now();
  const bool overdue = bus_.waiting != Waiting::kNothing && t >= bus_.deadline;
  if (overdue || command.action == HandAction::kStop) {
    pump();
  } else if (bus_.waiting == Waiting::kNothing) {
    send_next(t);
  }
  return lost_ ? IoStatus::kDisconnected : IoStatus::kDone;
}

bool MiaHand::may_move(const HandCommand& command, TimePoint now) const noexcept {
  if (now > command.t_expires || command.joint_count != kMotors) return false;
  if (stop_.latched && (!stop_.hold_seen || stop_.phase != StopPhase::kOver)) return false;
  return std::all_of(command.q_rad.begin(), command.q_rad.begin() + kMotors, [](double q) { return std::isfinite(q); });
}

void MiaHand::queue_move(const HandCommand& command, TimePoint now) noexcept {
  std::array<double, kMotors> q_rad{};
  for (std::size_t i = 0; i < kMotors; ++i) {
    q_rad[i] = std::clamp(command.q_rad[i], config_.min_rad[i], config_.max_rad[i]);
  }
  const auto counts = motor_counts(config_.transmission, q_rad);
  for (std::size_t i = 0; i < kMotors; ++i) {
    const double lowest = i == at(Motor::kIndex) ? -kMaxCounts : 0;
    const int target = static_cast<int>(std::lround(std::clamp<double>(counts[i], lowest, kMaxCounts)));
    const bool news = !told_[i].known || told_[i].counts != target || now - told_[i].when >= kRefresh;
    cycle_.motion[i] = {news, target, command.t_expires};
  }
}

void MiaHand::drop_motion() noexcept {
  for (Motion& motion : cycle_.motion) motion.pending = false;
}

void MiaHand::pump() noexcept {
  for (int i = 0; i < kLinesPerCall; ++i) {
    std::string_view line;
    const IoStatus status = line_->receive(line);
    if (status == IoStatus::kDisconnected) return hang_up();
    if (status != IoStatus::kDone) break;
    take_line(line, transport::now());
  }
  const TimePoint now = transport::now();
  if (bus_.waiting != Waiting::kNothing && now >= bus_.deadline) take_timeout();
  if (bus_.waiting == Waiting::kNothing && !lost_) send_next(now);
}

void MiaHand::take_line(std::string_view line, TimePoint now) noexcept {
  if (bus_.waiting == Waiting::kAck && acknowledges(line, bus_.command)) {
    take_ack(now);
    return;
  }
  const auto counts = bus_.waiting == Waiting::kData ? parse_triple(line, TripleLine::kPosition) : std::nullopt;
  if (!counts) {
    ++counters_.mismatches;  // keep waiting: the right line may follow
    return;
  }
  bus_.waiting = Waiting::kNothing;
  std::copy(counts->begin(), counts->end(), reply_.counts.begin());
  reply_.t_arrival = now;
  reply_.ready = true;
  reply_.missed_in_a_row = 0;
  ++reply_.number;
  ++counters_.replies;
}

void MiaHand::take_ack(TimePoint now) noexcept {
  ++counters_.acks;
  bus_.timeouts_in_a_row = 0;
  bus_.waiting = Waiting::kNothing;
  switch (bus_.sent) {
    case Sent::kMotor:
      if (!stop_.latched) told_[bus_.motor] = {true, bus_.counts, bus_.t_sent};
      break;
    case Sent::kRead:
      bus_.waiting = Waiting::kData;
      bus_.deadline = now + config_.ack_timeout;
      break;
    case Sent::kStopAll:
    case Sent::kZeroSpeed:
      finish_stop_step(true);
      break;
  }
}

void MiaHand::take_timeout() noexcept {
  ++counters_.timeouts;
  ++bus_.timeouts_in_a_row;
  bus_.waiting = Waiting::kNothing;
  if (bus_.sent == Sent::kRead) ++reply_.missed_in_a_row;
  if (bus_.sent == Sent::kStopAll || bus_.sent == Sent::kZeroSpeed) finish_stop_step(false);
  // A stop is tried to its end: the hand may hear us although we do not hear the hand.
  if (stop_.phase != StopPhase::kOver) return;
  if (std::max(bus_.timeouts_in_a_row, reply_.missed_in_a_row) < config_.lost_after_timeouts) return;
  lost_ = true;
  reason_ = "the hand no longer answers; has it power?";
}

void MiaHand::send_next(TimePoint now) noexcept {
  if (stop_.phase != StopPhase::kOver) {
    send_stop_step(now);
    return;
  }
  for (std::size_t i = 0; i < kSlots; ++i) {
    const std::size_t slot = (cycle_.next_slot + i) % kSlots;
    if (!send_slot(slot, now)) continue;
    cycle_.next_slot = (slot + 1) % kSlots;
    return;
  }
}

bool MiaHand::send_slot(std::size_t slot, TimePoint now) noexcept {
  if (slot == kReadSlot) {
    if (!std::exchange(cycle_.read_pending, false)) return false;
    transmit(encode_plain(kReadPositionsPayload), Sent::kRead, now);
    return true;
  }
  Motion& motion = cycle_.motion[slot];
  if (!std::exchange(motion.pending, false)) return false;
  if (now > motion.t_expires) {
    ++counters_.expired;
    return false;
  }
  told_[slot].known = false;  // until the ACK: the hand may or may not have heard it
  bus_.motor = slot;
  bus_.counts = motion.counts;
  transmit(encode_motor_position(static_cast<Motor>(slot), motion.counts, config_.speed_percent), Sent::kMotor, now);
  return true;
}

void MiaHand::transmit(const Command& command, Sent what, TimePoint now) noexcept {
  bus_.command = command;
  bus_.sent = what;
  bus_.waiting = Waiting::kAck;
  bus_.t_sent = now;
  bus_.deadline = now + config_.ack_timeout;
  ++counters_.commands;
  // A full buffer needs no care of its own: the ACK will not come.
  if (line_->send(command) == IoStatus::kDisconnected) hang_up();
}

void MiaHand::request_stop() noexcept {
  stop_.latched = true;
  stop_.hold_seen = false;
  drop_motion();
  if (stop_.phase != StopPhase::kOver || stop_.acknowledged) return;
  stop_.phase = StopPhase::kStopAll;
  stop_.tries = 0;
  ++counters_.stops;
  for (Told& told : told_) told.known = false;
}

void MiaHand::send_stop_step(TimePoint now) noexcept {
  if (stop_.phase == StopPhase::kStopAll) {
    ++stop_.tries;
    transmit(encode_plain(kStopAllPayload), Sent::kStopAll, now);
  } else {
    transmit(encode_motor_speed(static_cast<Motor>(stop_.motor), 0, kZeroSpeedCurrent_percent), Sent::kZeroSpeed, now);
  }
}

void MiaHand::finish_stop_step(bool acknowledged) noexcept {
  if (stop_.phase == StopPhase::kStopAll) {
    stop_.acknowledged = acknowledged;
    if (!acknowledged && stop_.tries < kStopTries) return;
    stop_.phase = StopPhase::kZeroSpeed;
    stop_.motor = 0;
    stop_.zero_speed_acks = 0;
    return;
  }
  if (acknowledged) ++stop_.zero_speed_acks;
  if (++stop_.motor < kMotors) return;
  stop_.phase = StopPhase::kOver;
  stop_.acknowledged = stop_.acknowledged || stop_.zero_speed_acks == kMotors;
}

}  // namespace embody::mia
