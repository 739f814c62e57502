#include "tests/support/closed_loop.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace embody::test {
namespace {

double largest(const Vector6& difference) {
  return difference.cwiseAbs().maxCoeff();
}

double quantile(std::vector<double> values, double q) {
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

double square_error(std::span<const CycleSample> samples, const Sine& sine, double lag_s) {
  double sum = 0.0;
  for (const CycleSample& sample : samples) sum += (sample.q_rad - sine.q_rad(sample.t_s - lag_s)).squaredNorm();
  return sum;
}

/// Least squares by narrowing steps: the error has one minimum within a quarter of the period.
double identify_lag(std::span<const CycleSample> samples, const Sine& sine) {
  double best_s = 0.1;
  for (double step_s = 0.02; step_s > 1e-5; step_s /= 2.0) {
    for (bool better = true; better;) {
      better = false;
      for (const double next_s : {best_s - step_s, best_s + step_s}) {
        if (next_s < 0.0 || next_s > 0.2) continue;
        if (square_error(samples, sine, next_s) < square_error(samples, sine, best_s)) best_s = next_s, better = true;
      }
    }
  }
  return best_s;
}

}  // namespace

Vector6 Sine::q_rad(double t_s) const {
  const double omega = 2.0 * std::numbers::pi * frequency_hz;
  const double x = std::clamp(t_s / growth_s, 0.0, 1.0);
  const double amplitude = amplitude_rad * x * x * (3.0 - 2.0 * x);
  return centre_rad + Vector6::Constant(amplitude * std::sin(omega * t_s));
}

Vector6 Sine::qd_rad_s(double t_s) const {
  const double omega = 2.0 * std::numbers::pi * frequency_hz;
  const double x = std::clamp(t_s / growth_s, 0.0, 1.0);
  const double amplitude = amplitude_rad * x * x * (3.0 - 2.0 * x);
  const double growth = amplitude_rad * 6.0 * x * (1.0 - x) / growth_s;
  return Vector6::Constant(amplitude * omega * std::cos(omega * t_s) + growth * std::sin(omega * t_s));
}

SineFollowing judge_sine(std::span<const CycleSample> samples, const Sine& sine) {
  const auto steady = std::find_if(samples.begin(), samples.end(),
                                   [&](const CycleSample& sample) { return sample.t_s >= sine.growth_s + 0.5; });
  const std::span<const CycleSample> judged(steady, samples.end());
  SineFollowing result;
  result.lag_s = identify_lag(judged, sine);
  std::vector<double> target, joint;
  for (const CycleSample& sample : judged) {
    target.push_back(largest(sample.q_target_rad - sine.q_rad(sample.t_s)));
    joint.push_back(largest(sample.q_rad - sine.q_rad(sample.t_s - result.lag_s)));
  }
  result.target_error_rad = *std::max_element(target.begin(), target.end());
  result.target_error_p99_rad = quantile(target, 0.99);
  result.joint_error_rad = *std::max_element(joint.begin(), joint.end());
  result.joint_error_p99_rad = quantile(joint, 0.99);
  return result;
}

StepFollowing judge_step(std::span<const CycleSample> samples, const Vector6& start_rad, const Vector6& goal_rad,
                         double cycle_s) {
  constexpr double kSettled_rad = 1e-3;
  const Vector6 direction = (goal_rad - start_rad).cwiseSign();
  StepFollowing result;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const CycleSample& sample = samples[i];
    result.speed_rad_s = result.speed_rad_s.cwiseMax(sample.qd_rad_s.cwiseAbs());
    result.overshoot_rad = result.overshoot_rad.cwiseMax((sample.q_rad - goal_rad).cwiseProduct(direction));
    if (largest(sample.q_rad - goal_rad) > kSettled_rad) {
      result.settled_s = -1.0;
    } else if (result.settled_s < 0.0) {
      result.settled_s = sample.t_s;
    }
    if (i == 0 || std::abs(sample.t_s - samples[i - 1].t_s - cycle_s) > 1e-6) continue;
    const Vector6 acceleration = (sample.qd_rad_s - samples[i - 1].qd_rad_s) / cycle_s;
    result.acceleration_rad_s2 = result.acceleration_rad_s2.cwiseMax(acceleration.cwiseAbs());
  }
  return result;
}

}  // namespace embody::test
