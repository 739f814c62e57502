#pragma once
// Hand pose a known, short time ahead, to make up for a known delay on the way to the robot.
#include <array>

#include "core/hal/types.hpp"

namespace embody::teleop {

struct PosePredictorConfig {
  Duration ahead{0};       ///< the known delay; 0: off
  double limit_m{0.03};    ///< most that a prediction moves the hand by
  double limit_rad{0.15};  ///< most that it turns the hand by
};

/// Steps once per hand pose, in order, behind PoseMonitor. Extrapolates with the filtered velocity and turning speed of
/// M, and only as far as that has been worth it: each prediction is compared with the pose that then came, and so is
/// the pose without prediction. The prediction counts in full while its error is at most half of the other, not at all
/// when it is no better, and in part between; translation and rotation each on their own. So a hand at rest, one that
/// trembles, and one that changes direction faster than `ahead` pass as measured.
class PosePredictor {
 public:
  /// Settings below zero count as zero.
  explicit PosePredictor(const PosePredictorConfig& config = {}) noexcept;

  /// Moves X_WM, and X_WH rigidly with it, to where they will be `ahead` after t_capture; nothing else changes.
  /// An invalid pose passes unchanged and restarts the predictor, as do a jump (HandPose::jumps) and steps in time of
  /// more than `kLongestGap` or backwards. With `ahead` zero, poses pass bit by bit. About 1 us, no heap.
  void step(HandPose& pose) noexcept;

  /// Part of the prediction that is used at present, 0..1.
  [[nodiscard]] double translation_weight() const noexcept { return translation_.weight(); }
  [[nodiscard]] double rotation_weight() const noexcept { return rotation_.weight(); }

  static constexpr Duration kVelocityLag = std::chrono::milliseconds(30);
  static constexpr Duration kScoreLag = std::chrono::milliseconds(100);  ///< memory of the comparison
  static constexpr Duration kLongestGap = std::chrono::milliseconds(200);
  static constexpr std::size_t kCapacity = 256;  ///< predictions under way: 200 ms at 1000 frames per second

 private:
  /// A prediction that waits for the pose it predicted.
  struct Pending {
    TimePoint t_due{};
    Pose X_WM{Pose::Identity()};        // when it was made
    Pose X_WM_ahead{Pose::Identity()};  // predicted
  };
  /// Filtered squared errors with and without prediction.
  struct Score {
    double predicted{0.0};
    double held{0.0};
    [[nodiscard]] double weight() const noexcept;
  };

  void restart(const HandPose& pose) noexcept;
  void update_velocity(const Pose& X_WM, double dt_s) noexcept;
  void judge(const HandPose& pose, double dt_s) noexcept;
  /// Where the velocity leads to, within the limits, as a translation and a rotation vector in W.
  [[nodiscard]] Eigen::Vector3d translation_ahead() const noexcept;
  [[nodiscard]] Eigen::Vector3d rotation_ahead() const noexcept;

  PosePredictorConfig config_;
  bool started_{false};
  TimePoint t_last_{};
  std::uint32_t jumps_{0};
  Pose X_WM_last_{Pose::Identity()};
  Eigen::Vector3d v_W_m_s_{Eigen::Vector3d::Zero()};
  Eigen::Vector3d w_W_rad_s_{Eigen::Vector3d::Zero()};
  Score translation_;
  Score rotation_;
  std::array<Pending, kCapacity> pending_;
  std::size_t first_{0};
  std::size_t count_{0};
};

}  // namespace embody::teleop
