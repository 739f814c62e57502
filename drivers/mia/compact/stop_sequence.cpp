#include "drivers/mia/compact/stop_sequence.hpp"

namespace embody::mia::compact {

bool StopSequence::request() noexcept {
  latched_ = true;
  hold_seen_ = false;
  if (busy() || acknowledged_) return false;
  phase_ = Phase::kAll;
  tries_ = 0;
  return true;
}

std::uint8_t StopSequence::target() const noexcept {
  return phase_ == Phase::kEach ? motor_ : kAllMotors;
}

void StopSequence::finish(bool acknowledged) noexcept {
  if (phase_ == Phase::kAll) {
    acknowledged_ = acknowledged;
    if (acknowledged) {
      phase_ = Phase::kOver;
    } else if (++tries_ >= kTries) {
      phase_ = Phase::kEach;
      motor_ = 0;
      motors_acknowledged_ = 0;
    }
    return;
  }
  if (phase_ != Phase::kEach) return;
  if (acknowledged) ++motors_acknowledged_;
  if (++motor_ < kMotors) return;
  phase_ = Phase::kOver;
  acknowledged_ = motors_acknowledged_ == kMotors;
}

}  // namespace embody::mia::compact
