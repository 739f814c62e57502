// One finger in one frame: cost, derivatives, and a small minimiser.
#include <cmath>

#include "core/hand/calibration_internal.hpp"
#include "core/math/so3_jacobian.hpp"

namespace embody::hand {

using namespace calibration;

/// Everything that one finger's angles in one frame have a say in: its markers, its prior given the habit, and the log
/// determinant of the curvature.
double CalibrationProblem::finger_cost(const CalibrationVariables& at, const HandModel& model, std::size_t k,
                                       std::size_t f, const Vector9& q_rad) const {
  const CalibrationVariables::Frame& frame = at.frames[k];
  const Matrix3d R = math::exp_so3(-frame.slip.head<3>());
  const Pose X_MH = at.X_HM.inverse();
  const FingerChain chain = model.chain(static_cast<Finger>(f), q_rad);
  const double per_m2 = 1.0 / (noise_m_ * noise_m_);
  double cost = angle_priors_[f].cost(q_rad, at.habit_rad[f]);
  Matrix9 hessian = angle_priors_[f].linearise(q_rad, at.habit_rad[f]).smooth_hessian;
  for (const std::size_t i : of_finger_[f]) {
    const auto& p_H = frames_.frames[k].p_H[i];
    if (!p_H) continue;
    const Vector3d p_M = R * (X_MH * *p_H - frame.slip.tail<3>());
    const double e = (model.point(markers_[i].finger, markers_[i].point, chain) - p_M).squaredNorm();
    const PointJacobian J = model.jacobian(markers_[i].finger, markers_[i].point, chain);
    cost += loss_.rho(e) * per_m2;
    hessian.noalias() += per_m2 * J.transpose() * J;
  }
  return cost + log_determinant(hessian.llt());
}

/// Gradient and Gauss-Newton matrices (of half the cost) of one finger in one frame.
void CalibrationProblem::linearise(const CalibrationVariables& at, const HandModel& model, std::size_t k, std::size_t f,
                                   FingerBlock& block) const {
  const CalibrationVariables::Frame& frame = at.frames[k];
  const Index n = kPlaces + 3 * idx(of_finger_[f].size());
  const AnglePrior::Model prior = angle_priors_[f].linearise(frame.q_rad[f], at.habit_rad[f]);
  block.prior = prior.hessian;
  block.hessian = prior.hessian;
  block.gradient = prior.gradient;
  block.coupling = Local::Zero(9, n);
  block.coupling.middleCols<kAngleBeliefs>(kHabit) = prior.coupling;
  block.local_hessian = LocalSquare::Zero(n, n);
  block.local_hessian.diagonal().segment<kAngleBeliefs>(kHabit) = prior.habit_hessian;
  block.local_gradient = LocalVector::Zero(n);
  block.local_gradient.segment<kAngleBeliefs>(kHabit) = prior.habit_gradient;

  const auto finger = static_cast<Finger>(f);
  const std::size_t first = first_joint(finger);
  const FingerChain chain = model.chain(finger, frame.q_rad[f]);
  const Pose X_MH = at.X_HM.inverse();
  const Matrix3d R_slip = math::exp_so3(-frame.slip.head<3>());
  const Matrix3d J_slip = math::left_jacobian_so3(-frame.slip.head<3>());
  Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxLocal> J_local(3, n);
  block.chain = chain;
  block.seen.clear();
  block.volume = prior.smooth_hessian;
  const double per_m2 = 1.0 / (noise_m_ * noise_m_);
  for (const std::size_t i : of_finger_[f]) {
    const auto& p_H = frames_.frames[k].p_H[i];
    if (!p_H) continue;
    const CalibrationMarker& marker = markers_[i];
    const Vector3d p_M0 = X_MH * *p_H;
    const Vector3d p_M = R_slip * (p_M0 - frame.slip.tail<3>());
    const Vector3d r = model.point(finger, marker.point, chain) - p_M;
    const double weight = per_m2 * loss_.weight(r.squaredNorm());
    const PointJacobian J = model.jacobian(finger, marker.point, chain);
    Eigen::Matrix<double, 3, 6> J_of_slip;
    J_of_slip << -cross(p_M) * J_slip, R_slip;
    block.seen.push_back({i, J});
    block.volume.noalias() += per_m2 * J.transpose() * J;
    if (weight <= 0.0) continue;
    const std::size_t level = marker.joint - first;
    J_local.setZero();
    J_local.middleCols<6>(kSlip) = J_of_slip;
    J_local.middleCols<10>(kShape) = joint_direction(data_, first);
    for (std::size_t l = 1; l <= level; ++l) {
      J_local.middleCols<10>(kShape) +=
          chain.R_M_parent[l] * (joint_direction(data_, first + l) - joint_direction(data_, first + l - 1));
    }
    J_local.middleCols<3>(kPose) = -R_slip * cross(p_M0);
    J_local.middleCols<3>(kPose + 3) = R_slip;
    J_local.middleCols<3>(kPlaces + 3 * idx(marker.point)) = chain.R_MJ[level];

    block.hessian.noalias() += weight * J.transpose() * J;
    block.gradient.noalias() += weight * J.transpose() * r;
    block.coupling.noalias() += weight * J.transpose() * J_local;
    block.local_hessian.noalias() += weight * J_local.transpose() * J_local;
    block.local_gradient.noalias() += weight * J_local.transpose() * r;
  }
}

/// Adds half the gradient of the log determinant of the curvature A = J^T J / s^2 + prior in the angles: the sum over
/// markers of trace(A^-1 J^T dJ) / s^2.
void CalibrationProblem::add_volume_gradient(const HandModel& model, std::size_t f, FingerBlock& block) const {
  const auto finger = static_cast<Finger>(f);
  const std::size_t first = first_joint(finger);
  const FingerChain& chain = block.chain;
  const Matrix9 inverse = block.volume.llt().solve(Matrix9::Identity());
  for (const auto& seen : block.seen) {
    const CalibrationMarker& marker = markers_[seen.marker];
    const std::size_t level = marker.joint - first;
    const PointJacobian M = seen.J * inverse / (noise_m_ * noise_m_);
    Eigen::Matrix<double, 3, 10> lever = Eigen::Matrix<double, 3, 10>::Zero();  // d (point - joint l) / d shape
    Vector3d turned = Vector3d::Zero();
    for (std::size_t l = level + 1; l-- > 0;) {
      Vector3d at_joint = Vector3d::Zero();
      for (Index i = 3 * idx(l); i < 3 * idx(l) + 3; ++i) at_joint += M.col(i).cross(chain.axes_M.col(i));
      turned += at_joint;
      block.local_gradient.segment<10>(kShape) += lever.transpose() * at_joint;
      if (l > 0) {
        lever += chain.R_M_parent[l] * (joint_direction(data_, first + l) - joint_direction(data_, first + l - 1));
      }
    }
    block.local_gradient.segment<3>(kPlaces + 3 * idx(marker.point)) += chain.R_MJ[level].transpose() * turned;
    for (Index axis = 0; axis < 3; ++axis) {
      Matrix9 second = Matrix9::Zero();
      model.add_curvature(finger, marker.point, chain, Vector3d::Unit(axis), second);
      block.gradient += second * M.row(axis).transpose();
    }
  }
}

/// Levenberg-Marquardt on the angles of one finger in one frame; returns the cost reached.
double CalibrationProblem::settle_finger(CalibrationVariables& at, const HandModel& model, std::size_t k, std::size_t f,
                                         int iterations, FingerBlock& block) const {
  constexpr double kEnough = 1e-4;
  Vector9& q = at.frames[k].q_rad[f];
  double cost = finger_cost(at, model, k, f, q);
  double damping = 1e-4;
  bool moved = true;
  for (int i = 0; i < iterations; ++i) {
    if (moved) {
      linearise(at, model, k, f, block);
      add_volume_gradient(model, f, block);
    }
    Matrix9 damped = block.hessian;
    damped.diagonal() *= 1.0 + damping;
    const Vector9 next = q - damped.llt().solve(block.gradient);
    const double next_cost = finger_cost(at, model, k, f, next);
    moved = next_cost < cost;
    if (!moved) {
      damping *= 30.0;
      continue;
    }
    const double gain = cost - next_cost;
    q = next;
    cost = next_cost;
    damping *= 0.1;
    if (gain < kEnough) break;
  }
  return cost;
}

void CalibrationProblem::settle_angles(CalibrationVariables& at) const {
  constexpr int kIterations = 3;
  const HandModel model = model_of(at);
  FingerBlock block;
  for (std::size_t k = 0; k < at.frames.size(); ++k) {
    for (std::size_t f = 0; f < kFingers; ++f) settle_finger(at, model, k, f, kIterations, block);
  }
}

std::size_t CalibrationProblem::restart_angles(CalibrationVariables& at) const {
  constexpr int kIterations = 15;
  constexpr double kBetter = 0.1;
  const HandModel model = model_of(at);
  std::size_t changed = 0;
  CalibrationVariables trial = at;
  FingerBlock block;
  for (std::size_t k = 0; k < at.frames.size(); ++k) {
    for (std::size_t f = 0; f < kFingers; ++f) {
      std::vector<Vector9> starts{angle_priors_[f].angles(at.habit_rad[f])};
      if (k > 0) starts.push_back(at.frames[k - 1].q_rad[f]);
      if (k + 1 < at.frames.size()) starts.push_back(at.frames[k + 1].q_rad[f]);
      double best = finger_cost(at, model, k, f, at.frames[k].q_rad[f]) - kBetter;
      bool better = false;
      for (const Vector9& start : starts) {
        trial.frames[k].q_rad[f] = start;
        const double cost = settle_finger(trial, model, k, f, kIterations, block);
        if (cost >= best) continue;
        best = cost;
        at.frames[k].q_rad[f] = trial.frames[k].q_rad[f];
        better = true;
      }
      trial.frames[k].q_rad[f] = at.frames[k].q_rad[f];
      changed += better ? 1 : 0;
    }
  }
  return changed;
}

}  // namespace embody::hand
