// The driver's conversation with streaming firmware: commands are sent as fast as the wire carries them, lines come by
// themselves. Nothing of this was tried on hardware.
#include <algorithm>

#include "drivers/mia/mia_hand.hpp"

namespace embody::mia {
namespace {

/// A command, the ACK that older firmware probably sends, 35 bytes at 115200 baud 8N1 together, and a millisecond to
/// think: whoever takes one command at a time has taken it by then.
constexpr Duration kWireTime = std::chrono::microseconds(4040);
constexpr Duration kStreamGap = std::chrono::milliseconds(300);  ///< longer than any stream period on record
constexpr Duration kAskPeriod = std::chrono::milliseconds(100);
constexpr Duration kGrace = std::chrono::milliseconds(200);  ///< for a position after a sign of life
constexpr Duration kArmAgain = std::chrono::seconds(1);

}  // namespace

void MiaHand::take_streamed(std::string_view line, TimePoint now) noexcept {
  if (const auto whole = parse_triple(line, TripleLine::kPosition)) {
    stream_.t_line = stream_.t_position = now;
    stream_.t_answered = {};
    const std::array<double, kMotors> counts{1.0 * (*whole)[0], 1.0 * (*whole)[1], 1.0 * (*whole)[2]};
    take_positions(counts, joint_angles_rad(config_.transmission, counts), now);
  } else if (telemetry_.take(line, now)) {
    stream_.t_line = now;
  } else if (is_acknowledgement(line)) {
    ++counters_.acks;
    stream_.t_line = now;
    const bool asked = stream_.t_asked > stream_.t_position;
    if (asked && stream_.t_answered == TimePoint{}) stream_.t_answered = now;
  } else {
    ++counters_.mismatches;
  }
}

/// The streams of a hand that restarted are off, but it answers: that tells a restart from a broken line.
void MiaHand::supervise_stream(TimePoint now) noexcept {
  if (now - stream_.t_line >= config_.silence_limit) {
    return lose("no line came from the hand for too long; has it power, and is the cable in?");
  }
  if (stream_.t_answered != TimePoint{} && now - stream_.t_answered >= kGrace) return hand_restarted();
  if (now - stream_.t_position >= config_.silence_limit) {
    lose("the hand no longer streams its positions; another program may have switched them off");
  }
}

void MiaHand::turn_streaming(TimePoint now) noexcept {
  if (now >= stream_.t_wire_free && send_streaming(now)) stream_.t_wire_free = now + kWireTime;
}

bool MiaHand::send_streaming(TimePoint now) noexcept {
  if (!stop_.over()) {
    transmit(stop_.next(), now);
    finish_stop_step(false, now);
    return true;
  }
  for (std::size_t i = 0; i < kMotors; ++i) {
    const std::size_t m = (next_slot_ + i) % kMotors;
    const auto motion = next_motion(m, now);
    if (!motion) continue;
    next_slot_ = (m + 1) % kMotors;
    queue_.heard(m, motion->value, now);
    transmit(*motion, now);
    return true;
  }
  if (now - stream_.t_position >= kStreamGap && now - stream_.t_asked >= kAskPeriod) {
    stream_.t_asked = now;
    transmit({.command = encode_plain(kOldPingPayload)}, now);
    return true;
  }
  for (const char channel : {'C', 'A'}) {
    const TimePoint t_last = channel == 'C' ? telemetry_.data().t_currents : telemetry_.data().t_forces;
    TimePoint& t_armed = stream_.t_armed[channel == 'C' ? 0 : 1];
    if (!telemetry_.wants(channel) || now - std::max(t_last, t_armed) < kArmAgain) continue;
    t_armed = now;
    transmit({.command = encode_stream(channel, true)}, now);
    return true;
  }
  return false;
}

}  // namespace embody::mia
