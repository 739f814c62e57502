#include "core/hand/finger_estimator.hpp"

#include <algorithm>

#include "core/math/bounded_least_squares.hpp"

namespace embody::hand {
namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;

Vector9 weights(double x1, double y1, double z1, double x2, double y2, double z2, double x3, double y3, double z3) {
  Vector9 w;
  w << x1, y1, z1, x2, y2, z2, x3, y3, z3;
  return w;
}

}  // namespace

FingerEstimatorConfig::FingerEstimatorConfig() noexcept {
  lower_rad.fill(Vector9::Constant(-0.4 * kPi));
  upper_rad.fill(Vector9::Constant(0.4 * kPi));
  const Vector9 thumb = weights(.01, .01, .01, .01, .01, .01, .01, .05, .05);
  const Vector9 plus = weights(.1, .001, .001, .1, .01, .001, .1, .01, .001);
  const Vector9 minus = weights(.1, .001, .001, .1, .05, .005, .1, .05, .005);
  weight_plus = {thumb, weights(.1, .001, .001, .1, .05, .001, .1, .05, .001), plus, plus, plus};
  weight_minus = {thumb, weights(.1, .001, .001, .1, .05, .5, .1, .05, .05), minus, minus, minus};
}

FingerEstimator::FingerEstimator(const HandModel& model, const GloveLayout& glove,
                                 const FingerEstimatorConfig& config) noexcept
    : model_(model), config_(config) {
  for (auto& slots : slots_) slots.fill(kMaxMarkers);
  for (const FingerMarker& marker : glove.finger_markers) {
    if (marker.point != 0 && marker.point != 1) continue;
    slots_[static_cast<std::size_t>(marker.finger)][static_cast<std::size_t>(marker.point)] = marker.slot;
  }
  for (std::size_t f = 0; f < kFingers; ++f) {
    q_rad_[f] = Vector9::Zero().cwiseMax(config_.lower_rad[f]).cwiseMin(config_.upper_rad[f]);
  }
}

void FingerEstimator::step(const MarkerFrame& frame, const HandPose& hand_pose, HandState& state) noexcept {
  state.frame_number = frame.frame_number;
  state.t_capture = frame.t_capture;
  state.t_arrival = frame.t_arrival;
  state.X_WM = hand_pose.X_WM;
  state.valid = hand_pose.valid;
  const Pose X_MW = hand_pose.X_WM.inverse();
  for (std::size_t f = 0; f < kFingers; ++f) {
    std::array<const Marker*, 2> markers{};
    std::uint8_t visible = 0;
    for (std::size_t point = 0; point < 2; ++point) {
      const std::size_t slot = slots_[f][point];
      if (slot >= kMaxMarkers || slot >= frame.count) continue;
      const Marker& marker = frame.markers[slot];
      if (!marker.visible || !marker.p_W.allFinite()) continue;
      markers[point] = &marker;
      ++visible;
    }
    state.visible_markers[f] = visible;
    if (hand_pose.valid && visible > 0) {
      solve(f, markers, X_MW, state);
    } else {
      hold(f, state);
    }
  }
}

void FingerEstimator::solve(std::size_t finger, const std::array<const Marker*, 2>& markers, const Pose& X_MW,
                            HandState& state) noexcept {
  const auto id = static_cast<Finger>(finger);
  std::array<Vector3d, 2> p_M_measured{};
  std::size_t observed_joints = 0;
  for (std::size_t point = 0; point < 2; ++point) {
    if (markers[point] == nullptr) continue;
    p_M_measured[point] = X_MW * markers[point]->p_W;
    observed_joints = std::max(observed_joints, model_.joints_moving(id, point));
  }
  // Residuals: three per marker (zero where it is not visible), then one per angle.
  const auto evaluate = [&](const Vector9& q, math::LeastSquaresModel<9, 15>& at) noexcept {
    const FingerKinematics kinematics = model_.finger_kinematics(id, q);
    at.r.setZero();
    at.J.setZero();
    for (std::size_t point = 0; point < 2; ++point) {
      if (markers[point] == nullptr) continue;
      const auto row = 3 * static_cast<Eigen::Index>(point);
      const Vector3d error = kinematics.p_M[point] - p_M_measured[point];
      at.r.segment<3>(row) = error;
      at.J.middleRows<3>(row) = kinematics.J[point];
      add_curvature(kinematics, point, error, at.curvature);
    }
    for (Eigen::Index i = 0; i < 9; ++i) {
      const double w = q(i) >= 0.0 ? config_.weight_plus[finger](i) : config_.weight_minus[finger](i);
      at.r(6 + i) = w * q(i);
      at.J(6 + i, i) = w;
    }
  };
  // An angle that no visible marker depends on keeps its value instead of falling back to zero.
  Vector9 lower = config_.lower_rad[finger];
  Vector9 upper = config_.upper_rad[finger];
  for (Eigen::Index i = 3 * static_cast<Eigen::Index>(observed_joints); i < 9; ++i) {
    lower(i) = upper(i) = q_rad_[finger](i);
  }
  const auto solution = math::solve_bounded_least_squares<9, 15>(evaluate, q_rad_[finger], lower, upper,
                                                                 {config_.max_iterations, config_.tolerance});
  iterations_[finger] = solution.iterations;
  if (solution.status == math::LeastSquaresStatus::kInvalid) return hold(finger, state);
  q_rad_[finger] = solution.x;
  known_[finger] = true;
  const std::array<Vector3d, 2> p_M = model_.finger_points(id, solution.x);
  double distance_m = 0.0;
  for (std::size_t point = 0; point < 2; ++point) {
    if (markers[point] != nullptr) distance_m += (p_M[point] - p_M_measured[point]).norm();
  }
  residual_m_[finger] = distance_m / state.visible_markers[finger];
  state.q_rad.segment<9>(static_cast<Eigen::Index>(kFingerOffset[finger])) = solution.x;
  state.p_M[finger] = p_M;
  state.residual_m[finger] = residual_m_[finger];
  state.quality[finger] = solution.converged() ? FingerQuality::kOptimal : FingerQuality::kCapped;
}

void FingerEstimator::hold(std::size_t finger, HandState& state) noexcept {
  iterations_[finger] = 0;
  state.q_rad.segment<9>(static_cast<Eigen::Index>(kFingerOffset[finger])) = q_rad_[finger];
  state.p_M[finger] = model_.finger_points(static_cast<Finger>(finger), q_rad_[finger]);
  state.residual_m[finger] = residual_m_[finger];
  state.quality[finger] = known_[finger] ? FingerQuality::kHeld : FingerQuality::kNone;
}

}  // namespace embody::hand
