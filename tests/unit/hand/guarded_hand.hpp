#pragma once
// The chain from marker frames to finger angles, with the marker guard in it or without.
#include "core/hand/finger_estimator.hpp"
#include "core/hand/hand_pose_estimator.hpp"

namespace embody::test {

class GuardedHand {
 public:
  explicit GuardedHand(bool guarded) : fingers_(hand::HandModel{}, hand::paper_glove(), config(guarded)) {}

  void step(const MarkerFrame& frame, HandState& state) {
    hand_pose_ = pose_.step(frame);
    fingers_.step(frame, hand_pose_, state);
  }

  [[nodiscard]] const HandPose& hand_pose() const { return hand_pose_; }
  [[nodiscard]] const hand::CheckedMarkers& markers() const { return fingers_.markers(); }
  [[nodiscard]] double slip_m() const { return fingers_.slip_m(); }

 private:
  static hand::FingerEstimatorConfig config(bool guarded) {
    hand::FingerEstimatorConfig config;
    config.trust_labels = !guarded;
    return config;
  }

  hand::HandPoseEstimator pose_{hand::paper_glove(), hand::paper_calibration()};
  hand::FingerEstimator fingers_;
  HandPose hand_pose_;
};

}  // namespace embody::test
