#include "core/teleop/arm_controller.hpp"

#include <algorithm>

namespace embody::teleop {
namespace {

constexpr double kBlendGain = 4.0;         // 1/s: the offset's end is exponential instead of a stop
constexpr double kLargestStep_rad = 0.35;  // a larger joint step of one tick is a branch flip

bool inside(const Box& box, const Eigen::Vector3d& p) noexcept {
  return (p.array() >= box.min_m.array()).all() && (p.array() <= box.max_m.array()).all();
}

/// `v` shortened by at most `speed * dt`, never past zero.
Eigen::Vector3d shrink(const Eigen::Vector3d& v, double speed, double dt_s) noexcept {
  const double length = v.norm();
  if (length < 1e-9) return Eigen::Vector3d::Zero();
  return v * (1.0 - std::min({1.0, kBlendGain * dt_s, speed * dt_s / length}));
}

}  // namespace

ArmController::ArmController(const ArmControllerConfig& config) noexcept
    : config_(config), X_ME_(config.X_PM.inverse() * config.X_EP.inverse()), gate_(config.joints) {
  range_.lower_rad = config.joints.lower_rad;
  range_.upper_rad = config.joints.upper_rad;
}

std::optional<Pose> ArmController::target(TimePoint now) const noexcept {
  const std::optional<Pose> X_WM = poses_.at(now - config_.resample_delay);
  if (!X_WM) return std::nullopt;
  return config_.X_BW * *X_WM * X_ME_;
}

bool ArmController::track_measured(TimePoint now, const Vector6& q_rad) noexcept {
  gate_.reset(q_rad);
  q_d_rad_ = q_rad;
  X_BEr_ = robot::forward_kinematics(q_rad, config_.geometry);
  const std::optional<Pose> X_BEt = target(now);
  if (!X_BEt || !math::is_valid(*X_BEt)) return false;
  X_BEd_ = config_.clutch == Clutch::kAbsolute ? *X_BEt : X_BEr_;
  return inside(config_.workspace_B, X_BEd_.translation()) &&
         robot::solve_nearest(X_BEd_, q_rad, range_, config_.geometry).ok();
}

void ArmController::engage(TimePoint now) noexcept {
  q_d_rad_ = gate_.q_rad();
  X_BEr_ = robot::forward_kinematics(q_d_rad_, config_.geometry);
  const Pose X_BEt = target(now).value_or(X_BEr_);
  p_offset_B_ = X_BEr_.translation() - X_BEt.translation();
  R_offset_ = X_BEt.linear().transpose() * X_BEr_.linear();
}

ArmReference ArmController::follow(TimePoint now, double dt_s) noexcept {
  if (config_.clutch == Clutch::kAbsolute) shrink_offset(dt_s);
  if (const std::optional<Pose> X_BEt = target(now)) {
    X_BEd_.translation() = X_BEt->translation() + p_offset_B_;
    X_BEd_.linear() = X_BEt->linear() * R_offset_;
  }
  ArmReference reference;
  reference.X_BEd = X_BEd_;
  const Pose X_BEn = limit_step(X_BEd_, dt_s);
  const Result<Vector6> q = robot::solve_nearest(X_BEn, q_d_rad_, range_, config_.geometry);
  const bool solved = q.ok() && (*q - q_d_rad_).cwiseAbs().maxCoeff() < kLargestStep_rad;
  Vector6 qd_d = Vector6::Zero();
  if (solved) {
    qd_d = ((*q - q_d_rad_) / dt_s).cwiseMax(-config_.joints.speed_rad_s).cwiseMin(config_.joints.speed_rad_s);
    q_d_rad_ = *q;
    X_BEr_ = X_BEn;
  }
  const safety::FlangeLimit flange{robot::jacobian(gate_.q_rad(), config_.geometry), config_.speed_m_s,
                                   config_.speed_rad_s};
  gate_.follow(q_d_rad_, qd_d, dt_s, &flange);
  reference.q_rad = gate_.q_rad();
  reference.qd_rad_s = gate_.qd_rad_s();
  reference.reachable = solved && inside(config_.workspace_B, X_BEd_.translation());
  return reference;
}

ArmReference ArmController::brake(double dt_s) noexcept {
  gate_.brake(dt_s);
  q_d_rad_ = gate_.q_rad();
  X_BEr_ = robot::forward_kinematics(q_d_rad_, config_.geometry);
  X_BEd_ = X_BEr_;
  return {X_BEd_, gate_.q_rad(), gate_.qd_rad_s(), false};
}

void ArmController::shrink_offset(double dt_s) noexcept {
  p_offset_B_ = shrink(p_offset_B_, config_.blend_speed_m_s, dt_s);
  R_offset_ = math::exp_so3(shrink(math::log_so3(R_offset_), config_.blend_speed_rad_s, dt_s));
}

/// The reference moves towards the target (clamped to the workspace) by at most the speed limits.
Pose ArmController::limit_step(const Pose& X_BEd, double dt_s) const noexcept {
  const Eigen::Vector3d p_d =
      X_BEd.translation().cwiseMax(config_.workspace_B.min_m).cwiseMin(config_.workspace_B.max_m);
  const Eigen::Vector3d d = p_d - X_BEr_.translation();
  const Eigen::Vector3d w = math::log_so3(X_BEr_.linear().transpose() * X_BEd.linear());
  const double d_max = config_.speed_m_s * dt_s;
  const double w_max = config_.speed_rad_s * dt_s;
  Pose X = Pose::Identity();
  X.translation() = X_BEr_.translation() + d * std::min(1.0, d_max / std::max(d.norm(), 1e-12));
  X.linear() = X_BEr_.linear() * math::exp_so3(w * std::min(1.0, w_max / std::max(w.norm(), 1e-12)));
  return X;
}

}  // namespace embody::teleop
