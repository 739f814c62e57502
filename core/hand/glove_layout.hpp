#pragma once
// Which marker of a MarkerFrame sits where on the hand.
#include <array>
#include <cstddef>

#include "core/base/fixed_string.hpp"
#include "core/base/static_vector.hpp"
#include "core/hal/types.hpp"

namespace embody::hand {

/// A marker on a finger and the model point that it corresponds to.
struct FingerMarker {
  Finger finger{Finger::kThumb};
  std::size_t point{0};  ///< index into the finger's HandPoints: 0 tip, 1 middle, further ones of the glove's own
  std::size_t slot{0};   ///< index into MarkerFrame::markers
};

struct GloveLayout {
  StaticVector<FixedString<48>, kMaxMarkers> names;  ///< the sensor's label of each slot
  std::array<std::size_t, 3> back_slots{0, 1, 2};    ///< top, left, right marker on the back of the hand
  /// Distances top-left, top-right, left-right of those three, m; zeros: not known, learnt from the first good frames.
  std::array<double, 3> back_edges_m{};
  StaticVector<FingerMarker, 32> finger_markers;
};

/// The right-hand glove of Fabisch et al. 2022, section "Record Mapping": three markers on the back of the hand and two
/// on each finger. Slots: hand_top hand_left hand_right, then <finger>_tip <finger>_middle from thumb to little finger.
[[nodiscard]] GloveLayout paper_glove() noexcept;

/// X_HM that goes with paper_glove(): the published calibration of that glove and its subject
/// (dfki-ric/hand_embodiment, configuration mano/20210610_april, BSD-3-Clause).
[[nodiscard]] Pose paper_calibration() noexcept;

}  // namespace embody::hand
