#include "core/hand/confidence.hpp"

#include <algorithm>
#include <cmath>

namespace embody::hand {
namespace {

constexpr double kUnseenSeconds = 0.3;

/// 1 for no error, 1/2 at `scale`; 0 for what is not a number.
double explained(double error_m, double scale_m) noexcept {
  const double ratio = std::abs(error_m) / scale_m;
  return std::isfinite(ratio) ? 1.0 / (1.0 + ratio * ratio) : 0.0;
}

double solve_confidence(FingerQuality quality) noexcept {
  switch (quality) {
    case FingerQuality::kOptimal:
      return 1.0;
    case FingerQuality::kAtLimit:
      return 0.9;
    case FingerQuality::kCapped:
      return 0.8;
    case FingerQuality::kHeld:
      return 0.7;
    case FingerQuality::kLost:
    case FingerQuality::kNone:
      break;
  }
  return 0.0;
}

}  // namespace

double finger_confidence(const FingerEvidence& evidence, const ConfidenceScale& scale) noexcept {
  if (evidence.markers == 0) return 0.0;
  const std::size_t usable = std::min(evidence.usable, evidence.markers);
  const double seen = 0.5 + 0.5 * static_cast<double>(usable) / static_cast<double>(evidence.markers);
  const double fresh = std::exp(-std::max(0.0, to_seconds(evidence.unseen)) / kUnseenSeconds);
  return seen * fresh * explained(evidence.residual_m, scale.residual_m) * solve_confidence(evidence.quality);
}

double hand_confidence(bool pose_valid, double fit_error_m, const std::array<double, kFingers>& finger_confidence,
                       const std::array<bool, kFingers>& carries_markers, const ConfidenceScale& scale) noexcept {
  double least = pose_valid ? explained(fit_error_m, scale.fit_error_m) : 0.0;
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (carries_markers[f]) least = std::min(least, finger_confidence[f]);
  }
  return std::clamp(least, 0.0, 1.0);
}

}  // namespace embody::hand
