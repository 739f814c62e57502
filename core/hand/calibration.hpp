#pragma once
// Shape of the hand, places of the glove's markers on it, and its pose under the back markers, all from some seconds of
// free finger motion. Offline: allocates.
#include <string>
#include <vector>

#include "core/hand/glove_layout.hpp"
#include "core/hand/hand_model.hpp"

namespace embody::hand {

/// Standard deviations of what is known before any frame was seen.
struct CalibrationPrior {
  Shape shape_sd{Shape::Constant(0.06)};  ///< relative; anthropometry (Buryanov & Kotiuk 2010; ANSUR II 2012)
  double marker_sd_m{0.008};              ///< a glove marker about its nominal place, per axis
  double X_HM_translation_sd_m{0.02};
  double X_HM_rotation_sd_rad{0.3};
  /// Least error of a measured marker, per axis: sensor, skin that moves over the bones, and joints that are not quite
  /// the model's. The real one is estimated from the residuals, but never below this.
  double noise_sd_m{0.001};
};

struct CalibrationOptions {
  CalibrationPrior prior;
  std::size_t max_frames{100};  ///< equally spaced along the way of the markers; 20 to 2000
  int max_iterations{150};      ///< in all; each costs about 20 ms with 100 frames
};

/// One calibrated number group and how certain it is.
struct CalibratedMarker {
  std::size_t slot{0};
  Finger finger{Finger::kThumb};
  std::size_t joint{0};                     ///< bone that carries it, MANO's order
  Eigen::Vector3d offset_m{0.0, 0.0, 0.0};  ///< from that joint in the flat hand of the calibrated shape
  Eigen::Vector3d sd_m{0.0, 0.0, 0.0};
  double residual_m{0.0};  ///< mean distance to the model in the frames used, outliers left out
  bool prior_only{false};  ///< the motion said (almost) nothing about it: sd > 0.9 of the prior's
};

struct Calibration {
  Shape shape{Shape::Zero()};
  Shape shape_sd{Shape::Zero()};
  std::array<bool, kHandShapeParameters> shape_prior_only{};
  Pose X_HM{Pose::Identity()};
  Vector6 X_HM_sd{Vector6::Zero()};      ///< rotation (rad), translation (m), about M's axes
  std::array<double, 3> back_edges_m{};  ///< median, as GloveLayout::back_edges_m
  std::vector<CalibratedMarker> markers;
  std::size_t frames_used{0};
  std::array<double, kFingers> motion_rad{};  ///< range (5 to 95 %) of flexion, summed over the finger's joints
  std::vector<std::string> advice;            ///< for the person: "move the ring finger more: ..."
};

/// Estimates shape, marker places and X_HM together: maximum a posteriori over selected frames, finger angles and the
/// error of each frame's hand pose integrated out (Laplace), robust to drop-outs, swaps and ghosts; docs/calibration.md
/// has the method and its measured accuracy. `points` and `X_HM` are the nominal values (prior means); `data` is the
/// hand at zero shape. Of simulated hands the truth was within two stated standard deviations for 95 % of
/// the numbers (docs/calibration.md). Errors: kInvalidArgument (too few usable frames: says
/// how many and why; a layout without finger markers; points, X_HM or prior that cannot be). Two to five seconds on one
/// core for ten seconds of motion.
[[nodiscard]] Result<Calibration> calibrate(const std::vector<MarkerFrame>& frames, const GloveLayout& glove,
                                            const HandData& data, const HandPoints& points, const Pose& X_HM,
                                            const CalibrationOptions& options = {});

/// The layout and points with which the estimators use a calibration: each marker gets a kBone point of its own, in
/// place of the one that it has (index 2 on) or behind the given points: tip and middle, [0] and [1], stay. Markers
/// that the calibration does not know keep their point.
struct CalibratedGlove {
  GloveLayout glove;
  HandPoints points;
};
[[nodiscard]] CalibratedGlove apply(const Calibration& calibration, const GloveLayout& glove, const HandPoints& points);

}  // namespace embody::hand
