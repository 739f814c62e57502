#include "tests/integration/faults/operator_motion.hpp"

#include <cmath>

#include "core/hand/glove_layout.hpp"
#include "core/hand/synthetic_motion.hpp"

namespace embody::faults {
namespace {

constexpr double kFrequency_hz = 0.5;
constexpr double kSwing_m = 0.12;  // 0.38 m/s at its fastest
constexpr double kRate_hz = 100.0;
// Of the synthetic motion: the hand is open before it grasps, and closed after.
constexpr std::size_t kOpenFrame = 300, kClosedFrame = 380;

}  // namespace

OperatorMotion::OperatorMotion() {
  const hand::SyntheticMotion motion;
  const hand::SyntheticFrame open = motion.frame(kOpenFrame);
  X_WM_middle_ = open.X_WM;
  q_open_rad_ = open.q_rad;
  q_closed_rad_ = motion.frame(kClosedFrame).q_rad;
  for (std::size_t i = 0; i < p_M_back_.size(); ++i) {
    p_M_back_[i] = X_WM_middle_.inverse() * open.markers.markers[i].p_W;
  }
}

OperatorMotion::Posture OperatorMotion::posture(double t_s) const {
  const double swing = std::sin(2.0 * M_PI * kFrequency_hz * t_s);
  Posture at{X_WM_middle_, q_open_rad_ + 0.5 * (1.0 + swing) * (q_closed_rad_ - q_open_rad_)};
  at.X_WM.translation() += kSwing_m * swing * Eigen::Vector3d(0.3, 0.9, 0.3).normalized();
  return at;
}

std::vector<Eigen::Vector3d> OperatorMotion::markers(double t_s) const {
  const Posture at = posture(t_s);
  std::vector<Eigen::Vector3d> p_W;
  for (const Eigen::Vector3d& p_M : p_M_back_) p_W.push_back(at.X_WM * p_M);
  for (std::size_t f = 0; f < kFingers; ++f) {
    const hand::Vector9 q = at.q_rad.segment<9>(static_cast<Eigen::Index>(kFingerOffset[f]));
    for (const Eigen::Vector3d& p_M : model_.finger_points(static_cast<Finger>(f), q)) p_W.push_back(at.X_WM * p_M);
  }
  return p_W;
}

std::array<Eigen::Vector3d, hand::kLandmarks> OperatorMotion::landmarks(double t_s) const {
  const Posture at = posture(t_s);
  auto points = hand::landmark_positions(model_, at.q_rad);
  for (Eigen::Vector3d& p : points) p = at.X_WM * p;
  return points;
}

sim::Motion operator_markers() {
  sim::Motion motion;
  motion.rate_hz = kRate_hz;
  motion.source = "the operator of the fault matrix";
  for (const auto& name : hand::paper_glove().names) motion.marker_names.emplace_back(name.view());
  motion.generate = [hand = OperatorMotion()](std::size_t frame, std::span<Marker> markers) {
    const auto p_W = hand.markers(static_cast<double>(frame) / kRate_hz);
    for (std::size_t i = 0; i < markers.size(); ++i) {
      markers[i].p_W = p_W[i];
      markers[i].visible = true;
    }
  };
  return motion;
}

}  // namespace embody::faults
