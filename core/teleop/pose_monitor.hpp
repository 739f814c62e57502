#pragma once
// Which hand poses may move a robot.
#include "core/hal/types.hpp"

namespace embody::teleop {

/// Marks poses that no hand can have reached since the last one as not valid, and counts good poses in a row. A sudden
/// but lasting change (a new measurement, markers re-identified) is accepted once `kAcceptAfter` poses agree on it; the
/// streak then starts anew and `jumps` counts it, so that no motion goes on across a jump.
class PoseMonitor {
 public:
  /// `gap`: a longer time between two poses begins a new streak.
  explicit PoseMonitor(Duration gap = std::chrono::milliseconds(50)) noexcept : gap_(gap) {}

  /// Markers may be others than before, or the sensor's clock has begun anew: nothing is known, and the next
  /// `kProbation` good poses do not count yet.
  void restart() noexcept {
    started_ = false;
    suspects_ = streak_ = 0;
    probation_ = kProbation;
  }

  void step(HandPose& pose) noexcept {
    judge(pose);
    if (probation_ == 0 || !pose.valid) return;
    --probation_;
    pose.valid = false;
    pose.streak = streak_ = 0;
  }

 private:
  // Peak wrist speed of fast reaching is about 3 m/s, of fast turning about 15 rad/s; the rest is measurement noise.
  static constexpr double kSpeed_m_s = 5.0;
  static constexpr double kSpeed_rad_s = 30.0;
  static constexpr double kNoise_m = 0.01;
  static constexpr double kNoise_rad = 0.1;
  static constexpr std::uint32_t kAcceptAfter = 5;
  static constexpr std::uint32_t kProbation = 50;

  void judge(HandPose& pose) noexcept {
    if (!pose.valid || !math::is_valid(pose.X_WM)) {
      pose.valid = false;
      streak_ = 0;
    } else if (!started_ || (plausible(pose, last_) && !confirms_suspect(pose))) {
      const bool gap = !started_ || pose.t_capture - last_.t_capture > gap_;
      streak_ = gap ? 1 : streak_ + 1;
      last_ = pose;
      started_ = true;
      suspects_ = 0;
    } else {
      suspects_ = suspects_ > 0 && plausible(pose, suspect_) ? suspects_ + 1 : 1;
      suspect_ = pose;
      streak_ = 0;
      pose.valid = false;
      if (suspects_ >= kAcceptAfter) {  // the next pose that agrees is good again
        last_ = pose;
        suspects_ = 0;
        ++jumps_;
      }
    }
    pose.streak = streak_;
    pose.jumps = jumps_;
  }

  /// Time alone makes a jump no motion: while poses gather at another place, what agrees with them is one of them, even
  /// when a hand could have got there meanwhile.
  [[nodiscard]] bool confirms_suspect(const HandPose& pose) const noexcept {
    return suspects_ > 0 && plausible(pose, suspect_) && least_time_s(pose, suspect_) < least_time_s(pose, last_);
  }

  /// What the fastest hand needs from one pose to the other.
  [[nodiscard]] static double least_time_s(const HandPose& a, const HandPose& b) noexcept {
    return (a.X_WM.translation() - b.X_WM.translation()).norm() / kSpeed_m_s +
           math::angle_between(a.X_WM.linear(), b.X_WM.linear()) / kSpeed_rad_s;
  }

  [[nodiscard]] static bool plausible(const HandPose& pose, const HandPose& before) noexcept {
    const double dt_s = std::max(0.0, to_seconds(pose.t_capture - before.t_capture));
    const double distance = (pose.X_WM.translation() - before.X_WM.translation()).norm();
    const double angle = math::angle_between(before.X_WM.linear(), pose.X_WM.linear());
    return distance <= kNoise_m + kSpeed_m_s * dt_s && angle <= kNoise_rad + kSpeed_rad_s * dt_s;
  }

  Duration gap_;
  HandPose last_;
  HandPose suspect_;
  bool started_{false};
  std::uint32_t suspects_{0};
  std::uint32_t streak_{0};
  std::uint32_t probation_{0};
  std::uint32_t jumps_{0};
};

}  // namespace embody::teleop
