#include "core/teleop/pose_predictor.hpp"

#include <algorithm>
#include <cmath>

namespace embody::teleop {
namespace {

Eigen::Vector3d shortened(const Eigen::Vector3d& v, double limit) noexcept {
  const double length = v.norm();
  return length > limit ? Eigen::Vector3d(limit / length * v) : v;
}

Pose moved(const Pose& X_WM, const Eigen::Vector3d& translation, const Eigen::Vector3d& rotation) noexcept {
  Pose X = Pose::Identity();
  X.translation() = X_WM.translation() + translation;
  X.linear() = math::exp_so3(rotation) * X_WM.linear();
  return X;
}

/// One step of an exponential filter that delays by `lag_s` whatever dt is.
template <class T>
T filtered(const T& last, const T& value, double lag_s, double dt_s) noexcept {
  return (lag_s * last + dt_s * value) / (lag_s + dt_s);
}

}  // namespace

PosePredictor::PosePredictor(const PosePredictorConfig& config) noexcept : config_(config) {
  config_.ahead = std::max(config.ahead, Duration{0});
  config_.limit_m = std::max(config.limit_m, 0.0);
  config_.limit_rad = std::max(config.limit_rad, 0.0);
}

double PosePredictor::Score::weight() const noexcept {
  return held > 0.0 ? std::clamp(2.0 - 2.0 * std::sqrt(predicted / held), 0.0, 1.0) : 0.0;
}

void PosePredictor::step(HandPose& pose) noexcept {
  if (config_.ahead == Duration{0}) return;
  const Duration dt = pose.t_capture - t_last_;
  const bool usable = pose.valid && math::is_valid(pose.X_WM);
  if (!usable || !started_ || pose.jumps != jumps_ || dt < Duration{0} || dt > kLongestGap) {
    restart(pose);
    started_ = usable;
    return;
  }
  if (dt > Duration{0}) {
    update_velocity(pose.X_WM, to_seconds(dt));
    judge(pose, to_seconds(dt));
    t_last_ = pose.t_capture;
    X_WM_last_ = pose.X_WM;
    if (count_ < kCapacity) {
      pending_[(first_ + count_++) % kCapacity] = {pose.t_capture + config_.ahead, pose.X_WM,
                                                   moved(pose.X_WM, translation_ahead(), rotation_ahead())};
    }
  }
  if (translation_.weight() == 0.0 && rotation_.weight() == 0.0) return;
  const Pose X_MH = pose.X_WM.inverse() * pose.X_WH;
  pose.X_WM = moved(pose.X_WM, translation_.weight() * translation_ahead(), rotation_.weight() * rotation_ahead());
  pose.X_WH = pose.X_WM * X_MH;
}

void PosePredictor::restart(const HandPose& pose) noexcept {
  t_last_ = pose.t_capture;
  jumps_ = pose.jumps;
  X_WM_last_ = pose.X_WM;
  v_W_m_s_.setZero();
  w_W_rad_s_.setZero();
  translation_ = rotation_ = {};
  count_ = 0;
}

void PosePredictor::update_velocity(const Pose& X_WM, double dt_s) noexcept {
  // (lag * last + change) / (lag + dt): the quotient change / dt is never formed.
  const double lag_s = to_seconds(kVelocityLag);
  const Eigen::Vector3d turn_W = math::log_so3(X_WM.linear() * X_WM_last_.linear().transpose());
  v_W_m_s_ = (lag_s * v_W_m_s_ + (X_WM.translation() - X_WM_last_.translation())) / (lag_s + dt_s);
  w_W_rad_s_ = (lag_s * w_W_rad_s_ + turn_W) / (lag_s + dt_s);
}

void PosePredictor::judge(const HandPose& pose, double dt_s) noexcept {
  Score translation;
  Score rotation;
  double due = 0.0;
  for (; count_ > 0 && pending_[first_].t_due <= pose.t_capture; first_ = (first_ + 1) % kCapacity, --count_) {
    const Pending& past = pending_[first_];
    const double s = 1.0 - to_seconds(pose.t_capture - past.t_due) / dt_s;
    const Pose X_WM = math::interpolate(X_WM_last_, pose.X_WM, std::max(s, 0.0));
    translation.predicted += (past.X_WM_ahead.translation() - X_WM.translation()).squaredNorm();
    translation.held += (past.X_WM.translation() - X_WM.translation()).squaredNorm();
    rotation.predicted += std::pow(math::angle_between(past.X_WM_ahead.linear(), X_WM.linear()), 2);
    rotation.held += std::pow(math::angle_between(past.X_WM.linear(), X_WM.linear()), 2);
    due += 1.0;
  }
  if (due == 0.0) return;
  const double lag_s = to_seconds(kScoreLag);
  translation_.predicted = filtered(translation_.predicted, translation.predicted / due, lag_s, dt_s);
  translation_.held = filtered(translation_.held, translation.held / due, lag_s, dt_s);
  rotation_.predicted = filtered(rotation_.predicted, rotation.predicted / due, lag_s, dt_s);
  rotation_.held = filtered(rotation_.held, rotation.held / due, lag_s, dt_s);
}

Eigen::Vector3d PosePredictor::translation_ahead() const noexcept {
  return shortened(to_seconds(config_.ahead) * v_W_m_s_, config_.limit_m);
}

Eigen::Vector3d PosePredictor::rotation_ahead() const noexcept {
  return shortened(to_seconds(config_.ahead) * w_W_rad_s_, config_.limit_rad);
}

}  // namespace embody::teleop
