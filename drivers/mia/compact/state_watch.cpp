#include "drivers/mia/compact/state_watch.hpp"

#include <algorithm>

namespace embody::mia::compact {

void StateWatch::reset(TimePoint now) noexcept {
  motors_ = {};
  for (Motor& motor : motors_) motor.t = now;
}

void StateWatch::take(std::size_t motor, const State& state, TimePoint t) noexcept {
  Motor& known = motors_[motor];
  if (known.known) {
    const auto step = static_cast<std::uint8_t>(state.counter - known.state.counter);
    if (step == 0) {
      ++repeated_;
      return;
    }
    lost_ += step - 1u;
  }
  known = {state, std::max(t, known.t), true, true};
}

bool StateWatch::complete() const noexcept {
  return std::all_of(motors_.begin(), motors_.end(), [](const Motor& motor) { return motor.fresh; });
}

TimePoint StateWatch::take_set() noexcept {
  TimePoint oldest = motors_[0].t;
  for (Motor& motor : motors_) {
    motor.fresh = false;
    oldest = std::min(oldest, motor.t);
  }
  return oldest;
}

std::optional<std::size_t> StateWatch::silent(TimePoint now, Duration timeout) const noexcept {
  for (std::size_t i = 0; i < kMotors; ++i) {
    if (now - motors_[i].t > timeout) return i;
  }
  return std::nullopt;
}

std::array<double, kMotors> StateWatch::counts() const noexcept {
  std::array<double, kMotors> counts{};
  for (std::size_t i = 0; i < kMotors; ++i) counts[i] = motors_[i].state.counts;
  return counts;
}

}  // namespace embody::mia::compact
