#include "core/hand/calibration_problem.hpp"

#include <algorithm>
#include <cmath>

#include "core/hand/calibration_internal.hpp"
#include "core/math/so3_jacobian.hpp"

namespace embody::hand {

using namespace calibration;

namespace {

/// Where a point of the flat hand is, and the bone it follows most.
std::pair<std::size_t, Vector3d> flat_place(const HandData& data, std::size_t finger, const HandPoint& point) {
  const std::size_t first = first_joint(static_cast<Finger>(finger));
  switch (point.kind) {
    case HandPoint::Kind::kJoint:
      return {point.joint, Vector3d::Zero()};
    case HandPoint::Kind::kTip:
      return {first + 2, data.tips_M.col(idx(finger)) - data.joints_M.col(idx(first + 2))};
    case HandPoint::Kind::kSurface: {
      Vector3d p = point.offset_m;
      std::array<double, 3> weight{};
      for (std::size_t corner = 0; corner < 3; ++corner) {
        p += point.barycentric[corner] * data.mesh.vertices_M.col(point.vertices[corner]);
        for (std::size_t l = 0; l < 3; ++l) {
          weight[l] += point.barycentric[corner] * data.mesh.weights(point.vertices[corner], idx(first + l));
        }
      }
      const auto most = static_cast<std::size_t>(std::max_element(weight.begin(), weight.end()) - weight.begin());
      return {first + most, p - data.joints_M.col(idx(first + most))};
    }
    case HandPoint::Kind::kBone:
      break;
  }
  return {point.joint, point.offset_m};
}

}  // namespace

CalibrationProblem::CalibrationProblem(const HandData& data, const GloveLayout& glove, const HandPoints& points,
                                       const Pose& X_HM, const CalibrationPrior& prior, const CalibrationFrames& frames)
    : data_(data), prior_(prior), frames_(frames), X_HM_nominal_(X_HM) {
  for (const FingerMarker& given : glove.finger_markers) {
    const auto f = static_cast<std::size_t>(given.finger);
    const auto [joint, place] = flat_place(data, f, points[f][given.point]);
    of_finger_[f].push_back(markers_.size());
    markers_.push_back({given.slot, given.finger, joint, of_finger_[f].size() - 1, place});
  }
  for (std::size_t f = 0; f < kFingers; ++f) angle_priors_.emplace_back(static_cast<Finger>(f), data.side);
  slip_information_.setZero();
  for (const Vector3d& p_H : frames_.back_H) {
    Eigen::Matrix<double, 3, 6> J;
    J << -cross(X_HM.inverse() * p_H), Matrix3d::Identity();
    slip_information_ += J.transpose() * J;
  }
  const double noise_m = std::max(frames_.back_noise_m, 1e-5);
  slip_information_ /= noise_m * noise_m;
  blocks_.resize(frames_.frames.size());
}

CalibrationVariables CalibrationProblem::nominal() const {
  CalibrationVariables at;
  at.X_HM = X_HM_nominal_;
  for (std::size_t f = 0; f < kFingers; ++f) at.habit_rad[f] = angle_priors_[f].habit_mean_rad();
  for (const CalibrationMarker& marker : markers_) at.offset_m.push_back(marker.nominal_m);
  at.frames.resize(frames_.frames.size());
  for (CalibrationVariables::Frame& frame : at.frames) {
    for (std::size_t f = 0; f < kFingers; ++f) frame.q_rad[f] = angle_priors_[f].angles(at.habit_rad[f]);
  }
  return at;
}

HandModel CalibrationProblem::model_of(const CalibrationVariables& at) const {
  HandPoints points;
  for (std::size_t i = 0; i < markers_.size(); ++i) {
    HandPoint point;
    point.joint = markers_[i].joint;
    point.offset_m = at.offset_m[i];
    points[static_cast<std::size_t>(markers_[i].finger)].push_back(point);
  }
  return {data_, at.shape, points};
}

double CalibrationProblem::cost(const CalibrationVariables& at) const {
  const HandModel model = model_of(at);
  double cost = 0.0;
  for (std::size_t k = 0; k < at.frames.size(); ++k) {
    cost += at.frames[k].slip.dot(slip_information_ * at.frames[k].slip);
    for (std::size_t f = 0; f < kFingers; ++f) cost += finger_cost(at, model, k, f, at.frames[k].q_rad[f]);
  }
  cost /= redundancy_;
  for (std::size_t f = 0; f < kFingers; ++f) {
    const AnglePrior& prior = angle_priors_[f];
    cost += (at.habit_rad[f] - prior.habit_mean_rad()).cwiseQuotient(prior.habit_sd_rad()).squaredNorm();
  }
  cost += at.shape.cwiseQuotient(prior_.shape_sd).squaredNorm();
  for (std::size_t i = 0; i < markers_.size(); ++i) {
    cost += (at.offset_m[i] - markers_[i].nominal_m).squaredNorm() / (prior_.marker_sd_m * prior_.marker_sd_m);
  }
  const Pose off = X_HM_nominal_.inverse() * at.X_HM;
  cost += math::log_so3(off.linear()).squaredNorm() / (prior_.X_HM_rotation_sd_rad * prior_.X_HM_rotation_sd_rad);
  cost += off.translation().squaredNorm() / (prior_.X_HM_translation_sd_m * prior_.X_HM_translation_sd_m);
  return cost;
}

void CalibrationProblem::set_spreads(const std::array<Habit, kFingers>& spread_rad) {
  constexpr double kLeastRad = 0.03, kMostRad = 1.0;
  for (std::size_t f = 0; f < kFingers; ++f) {
    for (std::size_t b = 0; b < angle_priors_[f].beliefs().size(); ++b) {
      if (!angle_priors_[f].beliefs()[b].voluntary) continue;
      angle_priors_[f].set_spread(b, std::clamp(spread_rad[f](idx(b)), kLeastRad, kMostRad));
    }
  }
}

Eigen::VectorXd CalibrationProblem::prior_sd() const {
  Eigen::VectorXd sd(hand_size());
  sd.head<10>() = prior_.shape_sd;
  sd.segment<3>(10).setConstant(prior_.X_HM_rotation_sd_rad);
  sd.segment<3>(13).setConstant(prior_.X_HM_translation_sd_m);
  for (std::size_t f = 0; f < kFingers; ++f) {
    sd.segment<kAngleBeliefs>(kHabitBegin + idx(f * kAngleBeliefs)) = angle_priors_[f].habit_sd_rad();
  }
  sd.tail(hand_size() - kPlacesBegin).setConstant(prior_.marker_sd_m);
  return sd;
}

std::optional<double> CalibrationProblem::distance_m(const CalibrationVariables& at, std::size_t frame,
                                                     std::size_t marker) const {
  const auto& p_H = frames_.frames[frame].p_H[marker];
  if (!p_H) return std::nullopt;
  const CalibrationVariables::Frame& of = at.frames[frame];
  const CalibrationMarker& m = markers_[marker];
  // One bone's place without a whole HandModel.
  const std::size_t first = first_joint(m.finger);
  const auto joint = [&](std::size_t j) -> Vector3d {
    return data_.joints_M.col(idx(j)) + joint_direction(data_, j) * at.shape;
  };
  Vector3d p_M = joint(first);
  Matrix3d R = Matrix3d::Identity();
  for (std::size_t l = 0; l <= m.joint - first; ++l) {
    if (l > 0) p_M += R * (joint(first + l) - joint(first + l - 1));
    R = R * math::exp_so3(of.q_rad[static_cast<std::size_t>(m.finger)].segment<3>(3 * idx(l)));
  }
  p_M += R * at.offset_m[marker];
  const Vector3d seen_M = math::exp_so3(-of.slip.head<3>()) * (at.X_HM.inverse() * *p_H - of.slip.tail<3>());
  return (p_M - seen_M).norm();
}

/// Columns in the hand's variables of a finger block's local variables, slip left out.
std::vector<Index> CalibrationProblem::hand_columns(std::size_t finger) const {
  std::vector<Index> columns;
  for (Index i = 0; i < kHabitBegin; ++i) columns.push_back(i);
  for (Index i = 0; i < idx(kAngleBeliefs); ++i) columns.push_back(kHabitBegin + idx(finger * kAngleBeliefs) + i);
  for (const std::size_t marker : of_finger_[finger]) {
    for (Index axis = 0; axis < 3; ++axis) columns.push_back(kPlacesBegin + 3 * idx(marker) + axis);
  }
  return columns;
}

void CalibrationProblem::add_hand_prior(const CalibrationVariables& at) {
  const Eigen::VectorXd information = prior_sd().cwiseAbs2().cwiseInverse();
  const auto add = [&](Index i, double off) {
    hand_gradient_(i) += information(i) * off;
    hand_hessian_(i, i) += information(i);
  };
  for (Index i = 0; i < 10; ++i) add(i, at.shape(i));
  for (std::size_t f = 0; f < kFingers; ++f) {
    const Habit off = at.habit_rad[f] - angle_priors_[f].habit_mean_rad();
    for (Index i = 0; i < off.size(); ++i) add(kHabitBegin + idx(f * kAngleBeliefs) + i, off(i));
  }
  for (std::size_t m = 0; m < markers_.size(); ++m) {
    for (Index axis = 0; axis < 3; ++axis) {
      add(kPlacesBegin + 3 * idx(m) + axis, at.offset_m[m](axis) - markers_[m].nominal_m(axis));
    }
  }
  const Pose off = X_HM_nominal_.inverse() * at.X_HM;
  const Vector3d w = math::log_so3(off.linear());
  const Matrix3d J_w = math::left_jacobian_so3(-w).inverse();
  const double per_rad2 = information(10), per_m2 = information(13);
  hand_gradient_.segment<3>(10) += per_rad2 * J_w.transpose() * w;
  hand_hessian_.block<3, 3>(10, 10) += per_rad2 * J_w.transpose() * J_w;
  hand_gradient_.segment<3>(13) += per_m2 * off.linear().transpose() * off.translation();
  hand_hessian_.block<3, 3>(13, 13) += per_m2 * Matrix3d::Identity();
}

/// Builds the normal equations and eliminates first the angles, then the slips.
bool CalibrationProblem::eliminate(const CalibrationVariables& at, double damping) {
  const HandModel model = model_of(at);
  const Index hand = hand_size();
  hand_hessian_ = Eigen::MatrixXd::Zero(hand, hand);
  hand_gradient_ = Eigen::VectorXd::Zero(hand);
  scores_ = Eigen::MatrixXd::Zero(hand, idx(blocks_.size()));
  std::array<std::vector<Index>, kFingers> columns;
  for (std::size_t f = 0; f < kFingers; ++f) columns[f] = hand_columns(f);
  const auto damp = [damping](auto&& square) { square.diagonal() *= 1.0 + damping; };
  Eigen::VectorXd undamped = Eigen::VectorXd::Zero(hand);  // diagonal before anything is eliminated
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    FrameBlock& frame = blocks_[k];
    Matrix6 slip = slip_information_;
    Vector6 slip_diagonal = slip.diagonal();
    frame.gradient = slip_information_ * at.frames[k].slip;
    frame.coupling = Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, hand);
    for (std::size_t f = 0; f < kFingers; ++f) {
      FingerBlock& block = frame.fingers[f];
      linearise(at, model, k, f, block);
      add_volume_gradient(model, f, block);
      slip_diagonal += block.local_hessian.diagonal().head<6>();
      for (std::size_t a = 0; a < columns[f].size(); ++a) {
        undamped(columns[f][a]) += block.local_hessian(6 + idx(a), 6 + idx(a));
      }
      Matrix9 damped = block.hessian;
      damp(damped);
      block.factor.compute(damped);
      if (block.factor.info() != Eigen::Success) return false;
      const Local eliminated = block.factor.solve(block.coupling);
      const LocalSquare square = block.local_hessian - block.coupling.transpose() * eliminated;
      const LocalVector gradient = block.local_gradient - eliminated.transpose() * block.gradient;
      slip += square.topLeftCorner<6, 6>();
      frame.gradient += gradient.head<6>();
      for (std::size_t a = 0; a < columns[f].size(); ++a) {
        scores_(columns[f][a], idx(k)) += gradient(6 + idx(a));
        frame.coupling.col(columns[f][a]) += square.block<6, 1>(0, 6 + idx(a));
        for (std::size_t b = 0; b < columns[f].size(); ++b) {
          hand_hessian_(columns[f][a], columns[f][b]) += square(6 + idx(a), 6 + idx(b));
        }
      }
    }
    slip.diagonal() += damping * slip_diagonal;
    frame.factor.compute(slip);
    if (frame.factor.info() != Eigen::Success) return false;
    const Eigen::Matrix<double, 6, Eigen::Dynamic> eliminated = frame.factor.solve(frame.coupling);
    hand_hessian_.noalias() -= frame.coupling.transpose() * eliminated;
    scores_.col(idx(k)) -= eliminated.transpose() * frame.gradient;
  }
  hand_hessian_ /= redundancy_;
  hand_gradient_ = scores_.rowwise().sum() / redundancy_;
  add_hand_prior(at);
  hand_hessian_.diagonal() += damping * (undamped / redundancy_ + prior_sd().cwiseAbs2().cwiseInverse());
  return true;
}

bool CalibrationProblem::step(const CalibrationVariables& at, double damping, CalibrationVariables& next) {
  if (!eliminate(at, damping)) return false;
  const Eigen::LLT<Eigen::MatrixXd> factor(hand_hessian_);
  if (factor.info() != Eigen::Success) return false;
  const Eigen::VectorXd d = -factor.solve(hand_gradient_);
  next = at;
  next.shape += d.head<10>();
  next.X_HM = at.X_HM * math::exp_se3(d.segment<6>(10));
  for (std::size_t m = 0; m < markers_.size(); ++m) next.offset_m[m] += d.segment<3>(kPlacesBegin + 3 * idx(m));
  for (std::size_t f = 0; f < kFingers; ++f) {
    next.habit_rad[f] += d.segment<kAngleBeliefs>(kHabitBegin + idx(f * kAngleBeliefs));
  }
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    const FrameBlock& frame = blocks_[k];
    const Vector6 slip = -frame.factor.solve(frame.gradient + frame.coupling * d);
    next.frames[k].slip += slip;
    for (std::size_t f = 0; f < kFingers; ++f) {
      const std::vector<Index> columns = hand_columns(f);
      LocalVector local(6 + idx(columns.size()));
      local.head<6>() = slip;
      for (std::size_t a = 0; a < columns.size(); ++a) local(6 + idx(a)) = d(columns[a]);
      next.frames[k].q_rad[f] -=
          frame.fingers[f].factor.solve(frame.fingers[f].gradient + frame.fingers[f].coupling * local);
    }
  }
  return d.allFinite();
}

}  // namespace embody::hand
