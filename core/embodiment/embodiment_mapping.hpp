#pragma once
// Hand state -> robot finger angles (paper, section "Embodiment Mapping").
#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/base/result.hpp"
#include "core/embodiment/embodiment_config.hpp"
#include "core/embodiment/hand_solver.hpp"
#include "core/hal/types.hpp"
#include "core/robot/hand_kinematics.hpp"

namespace embody {

/// Angles of all URDF joints of the hand, for display.
struct HandJointAngles {
  std::size_t count{0};
  std::array<double, robot::kMaxHandLinks> q_rad{};  ///< in the order of EmbodimentMapping::urdf_joint_names()
};

inline constexpr double kAnywhere = 1e3;  ///< rad: more than any range

/// Fingers that one solve moved together, because they share motors or touch.
struct HandGroup {
  FingerSet fingers;
  HandProblem::Variables start;
  StaticVector<MotorRange, kMaxHandJoints> ranges;  ///< by variable
  /// How far a motor may have come since the last frame: bounds one finger of many motors, whose minima end. Fingers
  /// that touch or avoid each other are free, for a gap counts more than a leap; so is whatever is sought everywhere.
  double reach_rad{kAnywhere};
  HandSolution solution;

  [[nodiscard]] StaticVector<MotorRange, kMaxHandJoints> within_reach() const noexcept;
};

/// Finds the motor angles r that bring the robot's finger points nearest to the human's:
/// minimise sum_i |X_PM p_M,i - g_i(r)|^2 within the motor limits, over the tip and the middle point of each finger,
/// and what the configuration adds (HandProblem). Fingers that share motors are solved together. Couplings hold
/// exactly: the motors are the unknowns.
class EmbodimentMapping {
 public:
  /// Checks `config` against the hand's URDF (already loaded).
  /// Errors: kNotFound, kInvalidArgument (names the key), kUnsupported (more joints, motors or knots than there is room
  /// for).
  [[nodiscard]] static Result<EmbodimentMapping> create(const robot::RobotModel& model, const EmbodimentConfig& config);

  /// One mapping. Copies frame number and times (t_solved and hand_confidence are the caller's). The target is invalid
  /// when the state is invalid or not finite; it then repeats the last valid angles. A joint is as sure as the least
  /// sure finger that it follows; fingers without an estimate (kNone: no marker, or none seen yet) are not followed,
  /// and a motor that has only such fingers keeps its angle with confidence 0. No heap; bounded work.
  void step(const HandState& state, FingerTarget& target) noexcept;

  [[nodiscard]] const Pose& X_PM() const noexcept { return X_PM_; }
  [[nodiscard]] std::size_t motor_count() const noexcept { return ranges_.size(); }
  /// Names of the motors, in the order of FingerTarget::q_rad.
  [[nodiscard]] const std::vector<std::string>& motor_names() const noexcept { return motor_names_; }
  [[nodiscard]] double lower_rad(std::size_t motor) const noexcept { return ranges_[motor].lower_rad; }
  [[nodiscard]] double upper_rad(std::size_t motor) const noexcept { return ranges_[motor].upper_rad; }

  /// Names of all moving URDF joints, mimic and coupled joints included.
  [[nodiscard]] const std::vector<std::string>& urdf_joint_names() const noexcept { return urdf_joint_names_; }
  /// Angles of all moving URDF joints for motor angles `r_rad` (targets or measured). @pre r_rad.size() >=
  /// motor_count()
  [[nodiscard]] HandJointAngles urdf_joint_angles(std::span<const double> r_rad) const noexcept;
  /// Robot finger points g(r) in P: [finger][0] tip, [1] middle; NaN for fingers that the hand lacks.
  [[nodiscard]] std::array<std::array<Eigen::Vector3d, 2>, kFingers> finger_points(
      std::span<const double> r_rad) const noexcept;
  /// Distance between the tip pads of two fingers (axes less radii), m; NaN without pads.
  [[nodiscard]] double pad_gap_m(Finger a, Finger b, std::span<const double> r_rad) const noexcept;

  [[nodiscard]] const robot::HandKinematics& kinematics() const noexcept { return kinematics_; }
  [[nodiscard]] const EmbodimentConfig& config() const noexcept { return config_; }
  /// Groups of the last step, for judges and reference solvers.
  [[nodiscard]] std::span<const HandGroup> groups() const noexcept { return {groups_.begin(), groups_.size()}; }
  /// The problem that a group of the last step solved.
  [[nodiscard]] HandProblem problem(const HandGroup& group) const noexcept {
    return {chains_, goal_, weights_, group.fingers};
  }

 private:
  explicit EmbodimentMapping(robot::HandKinematics kinematics) : kinematics_(std::move(kinematics)) {}
  Status make_ranges(const EmbodimentConfig& config);
  [[nodiscard]] FingerSet rate(const HandState& state, FingerTarget& target) const noexcept;
  void set_goal(const HandState& state, FingerSet follows) noexcept;
  void find_groups(FingerSet follows) noexcept;
  void solve(HandGroup& group) noexcept;
  void solve_within(HandGroup& group, HandProblem& problem) const noexcept;
  void solve_branches(HandGroup& group, const HandProblem& problem) noexcept;
  void keep_still(HandGroup& group, HandProblem& problem) noexcept;
  [[nodiscard]] FingerSet too_near() const noexcept;
  void separate() noexcept;

  robot::HandKinematics kinematics_;
  EmbodimentConfig config_;
  Pose X_PM_{Pose::Identity()};
  HandProblem::Chains chains_;
  std::array<FingerSet, kMaxHandJoints> moves_{};  // by motor
  std::vector<MotorRange> ranges_;                 // by motor
  std::vector<std::string> motor_names_;
  std::vector<std::string> urdf_joint_names_;
  std::vector<std::size_t> urdf_joints_;  // of the names above, in the model
  std::size_t thumb_motor_{robot::kNoIndex};
  HandWeights weights_;
  HandSolverOptions options_;

  HandGoal goal_;
  StaticVector<HandGroup, kFingers> groups_;
  std::array<double, kMaxHandJoints> last_rad_{};
  Duration dt_{0};
  TimePoint t_last_{};
  TimePoint t_judged_{};
  bool known_{false};    // a first valid hand was seen
  bool lateral_{false};  // branch of the thumb's motor
  Duration on_branch_{0};
  Duration better_for_{0};  // that the other branch has been, without a break
};

}  // namespace embody
