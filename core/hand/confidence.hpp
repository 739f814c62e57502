#pragma once
// How much a finger's or the hand's state is worth, as numbers that safety can act on. Pure functions.
#include "core/hal/types.hpp"

namespace embody::hand {

/// Errors at which confidence is halved; a sensor with more noise than markers needs greater ones.
struct ConfidenceScale {
  double residual_m{0.005};   ///< of a finger's markers to the model
  double fit_error_m{0.002};  ///< of the back of the hand to its known shape
};

/// What a finger's angles rest on.
struct FingerEvidence {
  std::size_t markers{0};                       ///< that the glove has on this finger
  std::size_t usable{0};                        ///< of them in this frame
  Duration unseen{0};                           ///< since one was usable
  double residual_m{0.0};                       ///< mean distance to the model in the last fit
  FingerQuality quality{FingerQuality::kNone};  ///< of the solve
};

/// 0 (nothing known) .. 1 (all markers seen and explained) as the product
///   (1 + usable/markers)/2 * exp(-unseen/0.3 s) * 1/(1 + (residual/scale)^2) * solve,
/// solve: optimal 1, at a limit 0.9, capped 0.8, held 0.7, lost and none 0. Monotone in each; 0 without markers and for
/// a residual that is not a number. A finger with half of its markers keeps 0.75, one held for 0.2 s about 0.18.
[[nodiscard]] double finger_confidence(const FingerEvidence& evidence, const ConfidenceScale& scale = {}) noexcept;

/// Of the hand: the least of the back of the hand, 1/(1 + (fit_error/scale)^2) or 0 when its pose is not valid, and of
/// the fingers that carry markers.
[[nodiscard]] double hand_confidence(bool pose_valid, double fit_error_m,
                                     const std::array<double, kFingers>& finger_confidence,
                                     const std::array<bool, kFingers>& carries_markers,
                                     const ConfidenceScale& scale = {}) noexcept;

}  // namespace embody::hand
