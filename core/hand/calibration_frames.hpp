#pragma once
// From marker frames to what the calibration fits: finger markers in the frame H of the back of the hand, and how sure
// that frame is.
#include <optional>
#include <vector>

#include "core/base/result.hpp"
#include "core/hand/glove_layout.hpp"

namespace embody::hand {

/// One frame: p_H[i] is marker glove.finger_markers[i] in H, if it was seen.
struct CalibrationFrame {
  std::size_t index{0};  ///< in the recording
  std::vector<std::optional<Eigen::Vector3d>> p_H;
};

struct CalibrationFrames {
  std::size_t recorded{0};                  ///< frames that the recording has
  std::array<double, 3> back_edges_m{};     ///< median distances top-left, top-right, left-right
  std::array<Eigen::Vector3d, 3> back_H{};  ///< the rigid triad with those edges, in H
  double back_noise_m{0.0};                 ///< per axis, from how far the triads are from that shape
  std::vector<CalibrationFrame> frames;     ///< those with a whole triad of that shape and a finger marker
};

/// Places the rigid median triad on each frame's back markers by least squares: H is the frame of that triad.
/// Error (kInvalidArgument): says how many frames are unusable and why.
[[nodiscard]] Result<CalibrationFrames> gather_frames(const std::vector<MarkerFrame>& frames, const GloveLayout& glove);

/// Up to `count` frames, equally spaced along the way that the markers travel in H: few where the fingers rest, many
/// where they move, without a preference for extremes (which would make noise and outliers look like motion).
[[nodiscard]] std::vector<CalibrationFrame> thin_out(const std::vector<CalibrationFrame>& frames, std::size_t count);

}  // namespace embody::hand
