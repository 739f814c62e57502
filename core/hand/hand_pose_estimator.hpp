#pragma once
// Pose of the human hand from the three markers on its back, or from a rigid body that the sensor tracks there: the
// cheap half of the record mapping.
#include <optional>

#include "core/hal/types.hpp"
#include "core/hand/glove_layout.hpp"
#include "core/hand/triad_check.hpp"

namespace embody::hand {

/// Marker frame H by the two-vector construction (Fabisch et al. 2022, section "Record Mapping"; Corke 2017):
/// z from the right to the top marker, y normal to the marker plane, origin in the right marker.
/// Returns false and leaves `X_WH` alone when the points are not finite or do not span a plane.
[[nodiscard]] bool hand_frame(const Eigen::Vector3d& p_W_top, const Eigen::Vector3d& p_W_left,
                              const Eigen::Vector3d& p_W_right, Pose& X_WH) noexcept;

/// The sensor's rigid body (MarkerFrame::body) on the back of the hand.
struct BodyPoseConfig {
  Pose X_BodyH{Pose::Identity()};  ///< marker frame H in the body's own frame, a calibration
  /// The body's markers may be so far from their known places, mean. What the triad's tolerance is to its edges.
  double tolerance_m{0.004};
};

/// Steps once per marker frame, in the order of the frames.
class HandPoseEstimator {
 public:
  /// `X_HM`: base of the hand model in the marker frame, a calibration of glove and subject. The shape of the triad is
  /// the glove's `back_edges_m`, or learnt when that is zero.
  HandPoseEstimator(const GloveLayout& glove, const Pose& X_HM, const TriadConfig& config = {}) noexcept;
  /// The back markers are not used: H follows the sensor's rigid body.
  HandPoseEstimator(const BodyPoseConfig& body, const Pose& X_HM) noexcept;

  /// X_WM = X_WH * X_HM. When a marker of the triad is missing, or the triad is degenerate or not the known one
  /// (triad_check.hpp), the pose is not valid and keeps its last value; so it is when the body is not visible, is no
  /// pose, or its markers are off their places. About 0.2 us, no heap. t_decoded and t_estimated are the caller's: core
  /// reads no clock.
  [[nodiscard]] HandPose step(const MarkerFrame& frame) noexcept;

  /// What became of the triad of the last frame; always missing with a rigid body.
  [[nodiscard]] const TriadCheck& triad() const noexcept { return triad_; }
  [[nodiscard]] bool follows_body() const noexcept { return body_.has_value(); }

 private:
  [[nodiscard]] bool triad_pose(const MarkerFrame& frame, Pose& X_WH) noexcept;
  [[nodiscard]] bool body_pose(const RigidBody& body, Pose& X_WH) noexcept;

  std::optional<BodyPoseConfig> body_;
  std::array<std::size_t, 3> back_slots_;
  Pose X_HM_;
  TriadCheck triad_;
  HandPose last_;
};

}  // namespace embody::hand
