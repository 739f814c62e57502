// From a rough guess to the maximum a posteriori: graduated noise, then a gate on outliers.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/hand/calibration_problem.hpp"

namespace embody::hand {
namespace {

/// Levenberg-Marquardt with the problem's present loss and noise, until two accepted steps in a row gain less than
/// `enough`; returns the iterations spent.
int descend(CalibrationProblem& problem, CalibrationVariables& at, int most, double enough) {
  constexpr double kFirstDamping = 0.03, kLeastDamping = 1e-6, kMostDamping = 1e6;
  double damping = kFirstDamping;
  double cost = problem.cost(at);
  CalibrationVariables next;
  int iterations = 0;
  int small = 0;
  while (iterations < most && damping < kMostDamping && small < 2) {
    ++iterations;
    double trial = std::numeric_limits<double>::infinity();
    if (problem.step(at, damping, next)) {
      problem.settle_angles(next);
      trial = problem.cost(next);
    }
    if (!(trial < cost)) {
      damping *= 5.0;
      continue;
    }
    small = cost - trial < enough ? small + 1 : 0;
    std::swap(at, next);
    cost = trial;
    damping = std::max(0.3 * damping, kLeastDamping);
  }
  return iterations;
}

}  // namespace

void solve(CalibrationProblem& problem, CalibrationVariables& at, const CalibrationOptions& options) {
  constexpr double kGate = 4.0;  // of outliers, in standard deviations per axis
  constexpr std::array<double, 4> kNoiseMetres{0.02, 0.01, 0.005, 0.0025};
  constexpr std::array<double, 5> kEnough{3.0, 1.0, 0.3, 0.1, 0.1};
  const double least_m = options.prior.noise_sd_m;
  int left = options.max_iterations;
  for (const double noise_m : kNoiseMetres) {
    problem.set_noise(std::max(noise_m, least_m));
    problem.set_loss({false, kGate * problem.noise()});
    left -= descend(problem, at, std::min(left, 8), 10.0);
    problem.restart_angles(at);
  }
  double noise_m = std::max(problem.certainty(at).noise_m, least_m);
  for (const double enough : kEnough) {
    problem.set_noise(noise_m);
    problem.set_loss({true, kGate * noise_m});
    left -= descend(problem, at, left, enough);
    problem.restart_angles(at);
    const CalibrationProblem::Certainty certainty = problem.certainty(at);
    problem.set_spreads(certainty.spread_rad);
    problem.set_redundancy(certainty.redundancy);
    noise_m = std::max(certainty.noise_m, least_m);
  }
}

}  // namespace embody::hand
