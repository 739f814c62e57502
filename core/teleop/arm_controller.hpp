#pragma once
// Hand pose -> joint set-points of the arm, once per robot cycle: resampling, clutch, limits, inverse kinematics, gate.
#include "core/hal/types.hpp"
#include "core/robot/ur_kinematics.hpp"
#include "core/safety/joint_gate.hpp"
#include "core/teleop/pose_resampler.hpp"

namespace embody::teleop {

enum class Clutch : std::uint8_t {
  kAbsolute,  ///< the arm goes to where the hand is (through X_BW) and stays on it
  kRelative,  ///< the arm repeats the hand's motion since engaging, from where the arm was
};

struct Box {
  Eigen::Vector3d min_m{-1.2, -1.2, -0.2};
  Eigen::Vector3d max_m{1.2, 1.2, 1.3};
};

struct ArmControllerConfig {
  robot::UrGeometry geometry = robot::kUr10e;
  Pose X_BW{Pose::Identity()};
  Pose X_PM{Pose::Identity()};
  Pose X_EP{Pose::Identity()};
  Clutch clutch{Clutch::kAbsolute};
  double blend_speed_m_s{0.25};  ///< at which the clutch offset shrinks (absolute clutch)
  double blend_speed_rad_s{0.8};
  Duration resample_delay{std::chrono::milliseconds(25)};
  double speed_m_s{0.25};  ///< of the flange reference
  double speed_rad_s{1.0};
  Box workspace_B;  ///< for the flange
  safety::JointLimits joints;
};

/// What one tick decided.
struct ArmReference {
  Pose X_BEd{Pose::Identity()};  ///< ungated target: clutch applied, no limits
  Vector6 q_rad{Vector6::Zero()};
  Vector6 qd_rad_s{Vector6::Zero()};
  bool reachable{false};  ///< target inside the workspace, within reach, and without a branch flip
};

class ArmController {
 public:
  explicit ArmController(const ArmControllerConfig& config) noexcept;

  /// Adds a valid hand pose (times increase).
  void add(TimePoint t_capture, const Pose& X_WM) noexcept { poses_.add(t_capture, X_WM); }

  /// Not commanding: the set-point follows the measured joints. Tells whether engaging now would find a target that is
  /// inside the workspace and reachable.
  [[nodiscard]] bool track_measured(TimePoint now, const Vector6& q_rad) noexcept;

  /// Sets the clutch so that motion starts at the present set-point, whatever the hand's pose.
  void engage(TimePoint now) noexcept;

  /// One tick of motion. @pre engage() was called since the last track_measured() or brake().
  ArmReference follow(TimePoint now, double dt_s) noexcept;
  /// One tick of braking within the joint limits.
  ArmReference brake(double dt_s) noexcept;

  /// The set-point has no motion any more: the robot's connection is gone.
  void halt() noexcept { gate_.reset(gate_.q_rad()); }

  [[nodiscard]] bool at_rest() const noexcept { return gate_.at_rest(); }

 private:
  /// Flange target without clutch at the robot's present, `resample_delay` in the past; nothing without poses.
  [[nodiscard]] std::optional<Pose> target(TimePoint now) const noexcept;
  void shrink_offset(double dt_s) noexcept;
  [[nodiscard]] Pose limit_step(const Pose& X_BEd, double dt_s) const noexcept;

  ArmControllerConfig config_;
  Pose X_ME_{Pose::Identity()};
  robot::UrJointRange range_;
  PoseResampler poses_;
  safety::JointGate gate_;
  // Clutch offset: X_BEd = (R_target R_offset, p_target + p_offset).
  Eigen::Vector3d p_offset_B_{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d R_offset_{Eigen::Matrix3d::Identity()};
  Pose X_BEd_{Pose::Identity()};      // last ungated target
  Pose X_BEr_{Pose::Identity()};      // speed-limited reference
  Vector6 q_d_rad_{Vector6::Zero()};  // inverse kinematics of the reference
};

}  // namespace embody::teleop
