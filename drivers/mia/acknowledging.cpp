// The driver's conversation with acknowledging firmware: one command at a time.
#include <algorithm>
#include <utility>

#include "drivers/mia/mia_hand.hpp"

namespace embody::mia {
namespace {

constexpr std::size_t kReadSlot = kMotors;
constexpr std::size_t kSlots = kMotors + 1;
/// A telemetry reading takes about 10 ms: asked for later after a write() than this, it could delay the next cycle's
/// motion (20 Hz).
constexpr Duration kTelemetryWindow = std::chrono::milliseconds(25);

}  // namespace

void MiaHand::take_answer(std::string_view line, TimePoint now) noexcept {
  switch (exchange_.take_line(line, now)) {
    case Exchange::Event::kNothing:  // the ACK; data follows
      ++counters_.acks;
      timeouts_in_a_row_ = 0;
      break;
    case Exchange::Event::kAcknowledged:
      ++counters_.acks;
      timeouts_in_a_row_ = 0;
      take_ack(now);
      break;
    case Exchange::Event::kData:
      take_data(line, now);
      break;
    case Exchange::Event::kLateAck:
      ++counters_.late_acks;
      break;
    case Exchange::Event::kTimedOut:
    case Exchange::Event::kStranger:
      ++counters_.mismatches;  // keep waiting: the right line may follow
      break;
  }
}

void MiaHand::take_ack(TimePoint now) noexcept {
  const Outgoing& outgoing = exchange_.outgoing();
  if (outgoing.purpose == Purpose::kMotion) {
    if (!stop_.latched()) queue_.heard(outgoing.motor, outgoing.value, exchange_.t_sent());
  } else {
    finish_stop_step(true, now);
  }
}

void MiaHand::take_data(std::string_view line, TimePoint now) noexcept {
  if (exchange_.outgoing().purpose == Purpose::kJointPositions) {
    if (const auto q_rad = parse_joint_positions(line)) {
      take_positions(motor_counts(config_.transmission, *q_rad), *q_rad, now);
    }
    return;
  }
  if (const auto whole = parse_triple(line, TripleLine::kPosition)) {
    const std::array<double, kMotors> counts{1.0 * (*whole)[0], 1.0 * (*whole)[1], 1.0 * (*whole)[2]};
    take_positions(counts, joint_angles_rad(config_.transmission, counts), now);
    return;
  }
  telemetry_.take(line, now);
}

void MiaHand::take_timeout(TimePoint now) noexcept {
  ++counters_.timeouts;
  ++timeouts_in_a_row_;
  const Outgoing& outgoing = exchange_.outgoing();
  switch (outgoing.purpose) {
    case Purpose::kStopAll:
    case Purpose::kZeroSpeed:
      finish_stop_step(false, now);
      break;
    case Purpose::kCurrents:
    case Purpose::kForces:
      telemetry_.missed(outgoing.purpose == Purpose::kForces ? 'A' : 'C');
      break;
    case Purpose::kPositions:
    case Purpose::kJointPositions:
      ++missed_replies_;
      break;
    case Purpose::kMotion:
      break;
  }
  // A stop is tried to its end: the hand may hear us although we do not hear the hand.
  if (!stop_.over()) return;
  if (std::max(timeouts_in_a_row_, missed_replies_) >= config_.lost_after_timeouts) return give_up();
  const bool reads = outgoing.purpose == Purpose::kPositions || outgoing.purpose == Purpose::kJointPositions;
  const bool moves = outgoing.purpose == Purpose::kMotion && !queue_.superseded(outgoing.motor, now);
  if (!reads && !moves) return;
  if (!exchange_.retry(now)) {
    ++counters_.resyncs;
    return exchange_.resynchronise(now);
  }
  ++counters_.retries;
  ++counters_.commands;
  if (line_->send(outgoing.command) == IoStatus::kDisconnected) hang_up();
}

void MiaHand::give_up() noexcept {
  if (exchange_.late_by() == Duration::zero()) return lose("the hand no longer answers; has it power?");
  const auto late_ms = std::chrono::duration_cast<std::chrono::milliseconds>(exchange_.late_by()).count();
  lose(make_error(Errc::kTimeout,
                  "the hand answers only after %lld ms: is the serial adapter in low-latency mode, and the line free?",
                  static_cast<long long>(late_ms))
           .detail.c_str());
}

void MiaHand::send_next(TimePoint now) noexcept {
  if (!stop_.over()) return transmit(stop_.next(), now);
  for (std::size_t i = 0; i < kSlots; ++i) {
    const std::size_t slot = (next_slot_ + i) % kSlots;
    if (slot != kReadSlot) {
      const auto motion = next_motion(slot, now);
      if (!motion) continue;
      transmit(*motion, now);
    } else {
      if (!std::exchange(read_pending_, false)) continue;
      t_asked_ = now;
      const bool joint = config_.space == Space::kJoint;
      transmit({.command = encode_read(joint ? 'J' : 'P'),
                .purpose = joint ? Purpose::kJointPositions : Purpose::kPositions},
               now);
    }
    next_slot_ = (slot + 1) % kSlots;
    return;
  }
  if (now - t_written_ > kTelemetryWindow) return;
  const char channel = telemetry_.next_channel();
  if (channel == '\0') return;
  transmit({.command = encode_read(channel), .purpose = channel == 'A' ? Purpose::kForces : Purpose::kCurrents}, now);
}

}  // namespace embody::mia
