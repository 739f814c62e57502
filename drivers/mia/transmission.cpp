#include "drivers/mia/transmission.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace embody::mia {
namespace {

// Passive thumb opposition: linear between two crank angles, from the vendor's ROS 2 transmission.
constexpr double kOppositionPerDelta = 0.8642;
constexpr double kOppositionOffset_rad = -0.0632;
constexpr double kOppositionMin_rad = -0.6283;

constexpr std::size_t at(Motor motor) noexcept {
  return static_cast<std::size_t>(motor);
}

/// Piecewise linear through rising knots; the first and last piece go on beyond the ends.
double interpolate(std::span<const double, kIndexKnots> xs, std::span<const double, kIndexKnots> ys,
                   double x) noexcept {
  const auto above = std::upper_bound(xs.begin() + 1, xs.end() - 1, x) - xs.begin();
  const auto i = static_cast<std::size_t>(above);
  return ys[i - 1] + (x - xs[i - 1]) * (ys[i] - ys[i - 1]) / (xs[i] - xs[i - 1]);
}

bool rises(std::span<const double, kIndexKnots> values) noexcept {
  for (std::size_t i = 0; i < kIndexKnots; ++i) {
    if (!std::isfinite(values[i])) return false;
    if (i > 0 && !(values[i] > values[i - 1])) return false;
  }
  return true;
}

bool is_usable(const LinearTransmission& linear) noexcept {
  return std::isfinite(linear.rad_per_count) && linear.rad_per_count > 0.0 && std::isfinite(linear.zero_counts);
}

}  // namespace

Status check(const Transmission& transmission) noexcept {
  if (!is_usable(transmission.thumb)) {
    return make_error(Errc::kInvalidArgument, "mia transmission: thumb rad_per_count must be positive and finite");
  }
  if (!is_usable(transmission.mrl)) {
    return make_error(Errc::kInvalidArgument, "mia transmission: mrl rad_per_count must be positive and finite");
  }
  const IndexTransmission& index = transmission.index;
  if (!std::isfinite(index.zero_counts) || !rises(index.counts) || !rises(index.delta_rad)) {
    return make_error(Errc::kInvalidArgument,
                      "mia transmission: index knots must rise strictly in counts and in delta_rad");
  }
  return {};
}

double index_delta_rad(const IndexTransmission& index, double counts) noexcept {
  return interpolate(index.counts, index.delta_rad, counts - index.zero_counts);
}

double index_counts(const IndexTransmission& index, double delta_rad) noexcept {
  return interpolate(index.delta_rad, index.counts, delta_rad) + index.zero_counts;
}

std::array<double, kMotors> joint_angles_rad(const Transmission& transmission,
                                             const std::array<double, kMotors>& counts) noexcept {
  const auto& [thumb, index, mrl] = transmission;
  return {thumb.rad_per_count * (counts[at(Motor::kThumb)] - thumb.zero_counts),
          index_delta_rad(index, counts[at(Motor::kIndex)]),
          mrl.rad_per_count * (counts[at(Motor::kMrl)] - mrl.zero_counts)};
}

std::array<double, kMotors> motor_counts(const Transmission& transmission,
                                         const std::array<double, kMotors>& q_rad) noexcept {
  const auto& [thumb, index, mrl] = transmission;
  return {q_rad[at(Motor::kThumb)] / thumb.rad_per_count + thumb.zero_counts,
          index_counts(index, q_rad[at(Motor::kIndex)]), q_rad[at(Motor::kMrl)] / mrl.rad_per_count + mrl.zero_counts};
}

double thumb_opposition_rad(double delta_rad) noexcept {
  return std::clamp(kOppositionPerDelta * delta_rad + kOppositionOffset_rad, kOppositionMin_rad, 0.0);
}

}  // namespace embody::mia
