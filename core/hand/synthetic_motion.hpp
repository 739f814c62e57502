#pragma once
// A demonstration recording made from nothing: what the 13-marker glove would see of a right hand that rests, reaches,
// grasps, lifts, carries, places, releases and returns. A pure function of configuration and frame index.
#include "core/hand/glove_layout.hpp"
#include "core/hand/hand_model.hpp"

namespace embody::hand {

struct SyntheticMotionConfig {
  double rate_hz{100.0};
  double duration_s{15.0};  ///< one cycle takes 15 s and ends where it began; longer motions repeat it
  std::uint64_t seed{1};    ///< of noise and drop-outs
};

/// One frame with the truth behind it.
struct SyntheticFrame {
  MarkerFrame markers;  ///< slots of paper_glove(); m in W; frame_number counts from 1
  Pose X_WH{Pose::Identity()};
  Pose X_WM{Pose::Identity()};
  Eigen::Matrix<double, kHandAngles, 1> q_rad;  ///< axis-angle, MANO's order
};

/// Wrist and fingers move along minimum-jerk segments (peak about 0.35 m/s and 1 rad/s) in the volume of a real
/// table-top recording. Finger markers are the model's marker points; the triad on the back of the hand is rigid
/// (55.2, 44.7, 32.4 mm). As in real recordings there are noise (0.03 mm per axis), gaps of thumb_tip of 0.16 to 0.57 s
/// while the hand is closed, drop-outs of one to five frames of the other finger markers, and, from 7 s on, a
/// persistent step of ring_tip by 8 mm. Integer random numbers and no library distributions: equal within 1 um with any
/// compiler.
class SyntheticMotion {
 public:
  explicit SyntheticMotion(const SyntheticMotionConfig& config = {}, const HandModel& model = HandModel{},
                           const Pose& X_HM = paper_calibration()) noexcept;

  /// duration * rate, rounded; 0 unless 0 < rate <= 10 kHz and 0 < duration <= 1e6 s.
  [[nodiscard]] std::size_t frame_count() const noexcept { return frame_count_; }

  /// Frame `k` (0-based), at time k / rate. t_capture = t_arrival = (k + 1) / rate after the epoch, which means
  /// "never".
  [[nodiscard]] SyntheticFrame frame(std::size_t k) const noexcept;

 private:
  [[nodiscard]] bool dropped(std::size_t slot, std::size_t k) const noexcept;

  SyntheticMotionConfig config_;
  HandModel model_;
  Pose X_MH_;
  std::size_t frame_count_{0};
};

}  // namespace embody::hand
