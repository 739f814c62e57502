#include "core/hand/hand_pose_estimator.hpp"

#include <cmath>

namespace embody::hand {

bool hand_frame(const Eigen::Vector3d& p_W_top, const Eigen::Vector3d& p_W_left, const Eigen::Vector3d& p_W_right,
                Pose& X_WH) noexcept {
  // Below these the directions are noise: real triads have edges of centimetres.
  constexpr double kShortestEdgeMetres = 1e-3;
  constexpr double kSmallestSine = 0.02;
  const Eigen::Vector3d approach = p_W_top - p_W_right;
  const Eigen::Vector3d side = p_W_left - p_W_right;
  const double approach_m = approach.norm();
  const double side_m = side.norm();
  const Eigen::Vector3d normal = approach.cross(side);
  const double normal_m2 = normal.norm();
  // Written so that a NaN or an overflow fails the test.
  if (!(approach_m > kShortestEdgeMetres && side_m > kShortestEdgeMetres)) return false;
  if (!(normal_m2 > kSmallestSine * approach_m * side_m && std::isfinite(normal_m2))) return false;
  const Eigen::Vector3d z = approach / approach_m;
  const Eigen::Vector3d y = normal / normal_m2;
  X_WH.linear().col(0) = y.cross(z);
  X_WH.linear().col(1) = y;
  X_WH.linear().col(2) = z;
  X_WH.translation() = p_W_right;
  return true;
}

HandPoseEstimator::HandPoseEstimator(const GloveLayout& glove, const Pose& X_HM, const TriadConfig& config) noexcept
    : back_slots_(glove.back_slots), X_HM_(X_HM), triad_(glove.back_edges_m, config) {}

HandPoseEstimator::HandPoseEstimator(const BodyPoseConfig& body, const Pose& X_HM) noexcept
    : body_(body), back_slots_{}, X_HM_(X_HM), triad_({}) {}

HandPose HandPoseEstimator::step(const MarkerFrame& frame) noexcept {
  ++last_.sequence;
  last_.frame_number = frame.frame_number;
  last_.t_capture = frame.t_capture;
  last_.t_arrival = frame.t_arrival;
  last_.fit_error_m = 0.0;
  Pose X_WH = last_.X_WH;
  last_.valid = body_ ? body_pose(frame.body, X_WH) : triad_pose(frame, X_WH);
  if (!last_.valid) return last_;
  last_.X_WH = X_WH;
  last_.X_WM = X_WH * X_HM_;
  return last_;
}

bool HandPoseEstimator::body_pose(const RigidBody& body, Pose& X_WH) noexcept {
  if (!body.visible || !math::is_valid(body.X_W)) return false;
  last_.fit_error_m = body.residual_m;
  X_WH = body.X_W * body_->X_BodyH;
  return body.residual_m <= body_->tolerance_m;  // false for NaN
}

bool HandPoseEstimator::triad_pose(const MarkerFrame& frame, Pose& X_WH) noexcept {
  Triad p_W;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t slot = back_slots_[i];
    const bool seen = slot < frame.count && slot < kMaxMarkers && frame.markers[slot].visible;
    if (!seen) {
      triad_.missing();
      return false;
    }
    p_W[i] = frame.markers[slot].p_W;
  }
  // First as labelled: a triad that spans no plane says nothing about shapes.
  if (!hand_frame(p_W[0], p_W[1], p_W[2], X_WH)) {
    triad_.missing();
    return false;
  }
  const TriadState state = triad_.step(p_W);
  last_.fit_error_m = triad_.error_m();
  if (!triad_.usable()) return false;
  return state != TriadState::kRelabelled || hand_frame(p_W[0], p_W[1], p_W[2], X_WH);
}

}  // namespace embody::hand
