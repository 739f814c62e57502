#include "drivers/mia/stop_sequence.hpp"

namespace embody::mia {
namespace {

constexpr int kStopTries = 4;
constexpr int kStreamingRounds = 3;
constexpr int kZeroSpeedCurrent_percent = 50;

}  // namespace

void StopSequence::begin(bool acknowledging) noexcept {
  *this = {};
  acknowledging_ = acknowledging;
}

bool StopSequence::request() noexcept {
  latched_ = true;
  hold_seen_ = false;
  if (!over() || heard_) return false;
  start();
  return true;
}

void StopSequence::repeat() noexcept {
  heard_ = false;
  if (over()) start();
}

void StopSequence::open() noexcept {
  begin(acknowledging_);
}

void StopSequence::start() noexcept {
  phase_ = acknowledging_ ? Phase::kStopAll : Phase::kZeroSpeed;
  rounds_left_ = acknowledging_ ? 1 : kStreamingRounds;
  tries_ = 0;
  motor_ = 0;
  zero_speed_acks_ = 0;
}

Outgoing StopSequence::next() noexcept {
  if (phase_ == Phase::kStopAll) {
    ++tries_;
    return {.command = encode_plain(kStopAllPayload), .purpose = Purpose::kStopAll};
  }
  return {.command = encode_motor_speed(static_cast<Motor>(motor_), 0, kZeroSpeedCurrent_percent),
          .purpose = Purpose::kZeroSpeed,
          .motor = motor_};
}

void StopSequence::finish(bool acknowledged) noexcept {
  if (phase_ == Phase::kStopAll) {
    heard_ = acknowledged;
    if (acknowledged || tries_ >= kStopTries) phase_ = Phase::kZeroSpeed;
    return;
  }
  if (phase_ == Phase::kOver) return;
  if (acknowledged) ++zero_speed_acks_;
  if (++motor_ < kMotors) return;
  motor_ = 0;
  if (--rounds_left_ > 0) return;
  phase_ = Phase::kOver;
  heard_ = heard_ || (acknowledging_ && zero_speed_acks_ == kMotors);
}

}  // namespace embody::mia
