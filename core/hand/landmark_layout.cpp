#include "core/hand/landmark_layout.hpp"

namespace embody::hand {
namespace {

constexpr std::size_t kFirstOwnPoint = 2;  // after tip and middle point

/// Slot of the first landmark of a finger that moves with it; two more follow.
constexpr std::size_t first_moving_slot(std::size_t finger) noexcept {
  return 4 * finger + 2;
}

}  // namespace

GloveLayout landmark_layout() noexcept {
  GloveLayout layout;
  for (const char* name : kLandmarkNames) layout.names.push_back(name);
  layout.back_slots = {9, 5, 17};  // knuckles of middle, index and little finger
  for (std::size_t finger = 0; finger < kFingers; ++finger) {
    for (std::size_t i = 0; i < 3; ++i) {
      layout.finger_markers.push_back({static_cast<Finger>(finger), kFirstOwnPoint + i, first_moving_slot(finger) + i});
    }
  }
  return layout;
}

FingerEstimatorConfig for_landmarks(FingerEstimatorConfig config) noexcept {
  config.trust_labels = true;
  config.least_confidence = 0.3;
  config.confidence = {/*residual_m=*/0.02, /*fit_error_m=*/0.01};
  return config;
}

HandPoints landmark_points(const HandData& data) {
  HandPoints points = default_points(data);
  for (std::size_t finger = 0; finger < kFingers; ++finger) {
    const std::size_t first = first_joint(static_cast<Finger>(finger));
    points[finger].resize(kFirstOwnPoint);
    for (const std::size_t joint : {first + 1, first + 2}) {
      HandPoint point;
      point.kind = HandPoint::Kind::kJoint;
      point.joint = joint;
      points[finger].push_back(point);
    }
    HandPoint tip;
    tip.kind = HandPoint::Kind::kTip;
    tip.joint = first + 2;
    points[finger].push_back(tip);
  }
  return points;
}

std::array<Eigen::Vector3d, kLandmarks> landmark_positions(const HandModel& model, const FingerAngles& q_rad) noexcept {
  Vector48 q_all_rad = Vector48::Zero();  // wrist at rest
  q_all_rad.tail<static_cast<int>(kHandAngles)>() = q_rad;
  const std::array<Pose, kHandModelJoints> X_MJ = model.joint_poses(q_all_rad);
  std::array<Eigen::Vector3d, kLandmarks> p_M;
  p_M[0] = X_MJ[0].translation();
  for (std::size_t finger = 0; finger < kFingers; ++finger) {
    const std::size_t first = first_joint(static_cast<Finger>(finger));
    const std::size_t slot = first_moving_slot(finger) - 1;
    for (std::size_t i = 0; i < 3; ++i) p_M[slot + i] = X_MJ[first + i].translation();
    p_M[slot + 3] = X_MJ[first + 2] * (model.rest_tips()[finger] - model.rest_joints()[first + 2]);
  }
  return p_M;
}

}  // namespace embody::hand
