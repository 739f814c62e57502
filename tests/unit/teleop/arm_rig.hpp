#pragma once
// An arm controller in a cell like the demo's, driven at 500 Hz in virtual time by a hand that is tracked at 100 Hz.
#include <cmath>
#include <functional>
#include <string>

#include "core/teleop/arm_controller.hpp"

namespace embody::test {

inline teleop::ArmControllerConfig cell_config(teleop::Clutch clutch) {
  teleop::ArmControllerConfig config;
  config.X_BW = math::pose_from({0.7, 0.2, 0.0}, Eigen::Vector3d::Zero()).inverse();
  config.X_EP = math::pose_from({0.0, 0.0, 0.05}, {M_PI / 2.0, 0.0, 0.0});
  config.X_PM = math::pose_from({0.01, 0.02, 0.06}, {0.3, -0.2, 0.5});
  config.clutch = clutch;
  config.joints.speed_rad_s << 1.0, 1.0, 1.5, 2.0, 2.0, 2.0;
  config.joints.acceleration_rad_s2 << 4.0, 4.0, 6.0, 10.0, 10.0, 10.0;
  config.joints.lower_rad << -2 * M_PI, -2 * M_PI, -M_PI, -2 * M_PI, -2 * M_PI, -2 * M_PI;
  config.joints.upper_rad = -config.joints.lower_rad;
  return config;
}

/// A usual posture: elbow up, wrist down.
inline Vector6 usual_posture() {
  return (Vector6() << 0.0, -1.5708, 1.5708, -1.5708, -1.5708, 0.0).finished();
}

class ArmRig {
 public:
  /// Path of the flange target over time, s; turned into the hand poses that mean it.
  using Path = std::function<Pose(double)>;
  static constexpr double kTick_s = 0.002;

  ArmRig(const teleop::ArmControllerConfig& cell, Path flange_path, Path distortion = {})
      : config(cell), controller(cell), path(std::move(flange_path)), distort(std::move(distortion)) {}

  /// Hand poses up to the present, and half a second of them before the start.
  void feed() {
    while (next_frame_s_ <= now_s) add_frame();
  }
  [[nodiscard]] TimePoint now() const { return TimePoint{std::chrono::seconds(100)} + from_seconds(now_s); }
  /// Hand pose whose ungated flange target is `X_BE`.
  [[nodiscard]] Pose hand_for(const Pose& X_BE) const {
    return config.X_BW.inverse() * X_BE * config.X_EP * config.X_PM;
  }
  /// The target that the controller looks at now: resampled in the past.
  [[nodiscard]] Pose target() const { return path(now_s - to_seconds(config.resample_delay)); }

  bool measure(const Vector6& q_rad) {
    feed();
    return controller.track_measured(now(), q_rad);
  }
  void engage() { controller.engage(now()); }
  teleop::ArmReference follow(double dt_s = kTick_s) {
    now_s += dt_s;
    feed();
    return controller.follow(now(), dt_s);
  }

  teleop::ArmControllerConfig config;
  teleop::ArmController controller;
  Path path;
  Path distort;  ///< replaces the hand pose when set
  double now_s{0.0};

 private:
  void add_frame() {
    const TimePoint t = TimePoint{std::chrono::seconds(100)} + from_seconds(next_frame_s_);
    controller.add(t, distort ? distort(next_frame_s_) : hand_for(path(next_frame_s_)));
    ++frame_;
    next_frame_s_ = -0.5 + 0.01 * frame_;
  }
  int frame_{0};
  double next_frame_s_{-0.5};
};

/// Checks set-points tick by tick against the joint limits.
class LimitCheck {
 public:
  LimitCheck(const safety::JointLimits& limits, const Vector6& q_start_rad) : limits_(limits), q_rad_(q_start_rad) {}

  /// Empty when this set-point keeps all limits, else what it breaks.
  std::string operator()(const teleop::ArmReference& reference, double dt_s) {
    std::string broken;
    const Vector6 moved = reference.q_rad - q_rad_;
    const Vector6 change = reference.qd_rad_s - qd_rad_s_;
    constexpr double kSlack = 1.0 + 1e-9;
    if (!reference.q_rad.allFinite() || !reference.qd_rad_s.allFinite()) broken += "not finite; ";
    if ((moved.array().abs() > limits_.speed_rad_s.array() * dt_s * kSlack).any()) broken += "speed; ";
    if ((change.array().abs() > limits_.acceleration_rad_s2.array() * dt_s * kSlack).any()) broken += "acceleration; ";
    if ((moved - reference.qd_rad_s * dt_s).cwiseAbs().maxCoeff() > 1e-12) broken += "speed is not the motion; ";
    if ((reference.q_rad.array() > limits_.upper_rad.array() + 1e-9).any() ||
        (reference.q_rad.array() < limits_.lower_rad.array() - 1e-9).any()) {
      broken += "joint range; ";
    }
    q_rad_ = reference.q_rad;
    qd_rad_s_ = reference.qd_rad_s;
    return broken;
  }

 private:
  safety::JointLimits limits_;
  Vector6 q_rad_;
  Vector6 qd_rad_s_{Vector6::Zero()};
};

inline double distance(const Pose& a, const Pose& b) {
  return (a.translation() - b.translation()).norm();
}
inline double angle(const Pose& a, const Pose& b) {
  return math::angle_between(a.linear(), b.linear());
}

inline ArmRig::Path resting_at(const Pose& X_BE) {
  return [X_BE](double) { return X_BE; };
}

/// A hand that moves smoothly around a flange pose.
inline ArmRig::Path waving_around(const Pose& X_BE, double amplitude_m, double amplitude_rad, double omega) {
  return [=](double t_s) {
    Pose X = X_BE;
    const double s = 0.5 - 0.5 * std::cos(omega * std::max(0.0, t_s));
    X.translation() += amplitude_m * s * Eigen::Vector3d(0.6, -0.8, 0.3);
    X.linear() = X_BE.linear() * math::exp_so3(amplitude_rad * s * Eigen::Vector3d(0.3, 0.5, -0.4));
    return X;
  };
}

}  // namespace embody::test
