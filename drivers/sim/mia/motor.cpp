#include "drivers/sim/mia/motor.hpp"

#include <algorithm>
#include <cmath>

namespace embody::sim {
namespace {

constexpr double kMaxSpeed = 90.0;  ///< units of the vendor
/// Counts per second at one unit: 65.4167 rad/s at the motor, divided by its radians per count.
constexpr std::array<double, mia::kMotors> kCountsPerUnit{65.4167 / 11.3895, 65.4167 / 8.673, 65.4167 / 7.0074};

}  // namespace

MiaMotor::MiaMotor(mia::Motor motor, double counts, double lag_s) noexcept
    : counts_per_s_per_unit_(kCountsPerUnit[static_cast<std::size_t>(motor)]),
      min_counts_(motor == mia::Motor::kIndex ? -mia::kMaxCounts : 0.0),
      lag_s_(std::max(lag_s, 1e-6)),
      counts_(std::clamp<double>(counts, min_counts_, mia::kMaxCounts)) {}

void MiaMotor::move_to(double target_counts, int speed_percent) noexcept {
  mode_ = Mode::kPosition;
  target_ = std::clamp<double>(target_counts, min_counts_, mia::kMaxCounts) + zero_;
  limit_ = std::clamp(speed_percent, 0, 99) * 0.01 * kMaxSpeed * counts_per_s_per_unit_;
  blocked_ = false;
}

void MiaMotor::drive(double speed) noexcept {
  mode_ = Mode::kSpeed;
  command_ = std::clamp(speed, -kMaxSpeed, kMaxSpeed) * counts_per_s_per_unit_;
  blocked_ = false;
}

void MiaMotor::halt() noexcept {
  mode_ = Mode::kHalted;
  rate_ = 0.0;
  blocked_ = false;
}

void MiaMotor::lose_counter() noexcept {
  halt();
  zero_ = counts_;
}

void MiaMotor::begin_calibration(int speed_percent) noexcept {
  move_to(0.0, speed_percent);
  target_ = 0.0;
}

void MiaMotor::advance(double dt_s) noexcept {
  if (stalled_) {
    rate_ = 0.0;
    const bool wants =
        mode_ == Mode::kPosition ? std::abs(target_ - counts_) > 0.5 : mode_ == Mode::kSpeed && command_ != 0.0;
    blocked_ = wants;
    return;
  }
  if (mode_ == Mode::kPosition) approach(dt_s);
  if (mode_ == Mode::kSpeed) coast(dt_s);
}

/// d(counts)/dt = (target - counts) / lag, clamped to the speed limit: a straight part, then an exponential.
void MiaMotor::approach(double dt_s) noexcept {
  const double direction = target_ < counts_ ? -1.0 : 1.0;
  double error = std::abs(target_ - counts_);
  if (const double beyond = error - limit_ * lag_s_; beyond > 0.0) {
    const double straight_s = limit_ > 0.0 ? std::min(dt_s, beyond / limit_) : dt_s;
    error -= limit_ * straight_s;
    dt_s -= straight_s;
  }
  error *= std::exp(-dt_s / lag_s_);
  counts_ = target_ - direction * error;
  rate_ = direction * std::min(limit_, error / lag_s_);
  stay_inside(true);
}

/// d(rate)/dt = (command - rate) / lag until an end of the range is reached.
void MiaMotor::coast(double dt_s) noexcept {
  const double decay = std::exp(-dt_s / lag_s_);
  counts_ += command_ * dt_s + (rate_ - command_) * lag_s_ * (1.0 - decay);
  rate_ = command_ + (rate_ - command_) * decay;
  stay_inside(command_ != 0.0);
}

void MiaMotor::stay_inside(bool pushing) noexcept {
  const double highest = std::clamp(contact_, min_counts_, 1.0 * mia::kMaxCounts);
  const double inside = std::clamp(counts_, min_counts_, highest);
  if (inside == counts_) return;
  blocked_ = pushing;
  counts_ = inside;
  rate_ = 0.0;
}

}  // namespace embody::sim
