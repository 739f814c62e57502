#pragma once
// Hand state -> robot finger angles (paper, section "Embodiment Mapping").
#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/base/result.hpp"
#include "core/embodiment/embodiment_config.hpp"
#include "core/hal/types.hpp"
#include "core/robot/hand_kinematics.hpp"

namespace embody {

/// Angles of all URDF joints of the hand, for display.
struct HandJointAngles {
  std::size_t count{0};
  std::array<double, robot::kMaxHandLinks> q_rad{};  ///< in the order of EmbodimentMapping::urdf_joint_names()
};

/// Finds the motor angles r that bring the robot's finger points nearest to the human's:
/// minimise sum_i |X_PM p_M,i - g_i(r)|^2 within the motor limits, over the tip and the middle point of each finger.
///
/// Each motor turns the fingers that it drives (Mia: middle, ring and little together) about fixed axes, so the cost is
/// A + B cos(r) + C sin(r): the global optimum is closed form, needs no start value and cannot get stuck.
/// step() costs about 1 us, neither allocates nor throws.
class EmbodimentMapping {
 public:
  /// Checks `config` against the hand's URDF (already loaded).
  /// Errors: kNotFound, kInvalidArgument (names the key), kUnsupported (a point that does not turn about exactly one
  /// motor-driven joint, or a motor whose couplings differ in ratio).
  [[nodiscard]] static Result<EmbodimentMapping> create(const robot::RobotModel& model, const EmbodimentConfig& config);

  /// One mapping. Copies frame number and times (t_solved and hand_confidence are the caller's). The target is invalid
  /// when the state is invalid or not finite; it then repeats the last valid angles. A joint is as sure as the least
  /// sure finger that it follows; fingers without an estimate (kNone: no marker, or none seen yet) are not followed,
  /// and a motor that has only such fingers keeps its angle with confidence 0.
  void step(const HandState& state, FingerTarget& target) noexcept;

  [[nodiscard]] const Pose& X_PM() const noexcept { return X_PM_; }
  [[nodiscard]] std::size_t motor_count() const noexcept { return motors_.size(); }
  /// URDF names of the motors' joints, in the order of FingerTarget::q_rad.
  [[nodiscard]] const std::vector<std::string>& motor_names() const noexcept { return motor_names_; }
  [[nodiscard]] double lower_rad(std::size_t motor) const noexcept { return motors_[motor].lower_rad; }
  [[nodiscard]] double upper_rad(std::size_t motor) const noexcept { return motors_[motor].upper_rad; }

  /// Names of all moving URDF joints, mimic joints and the thumb's opposition included.
  [[nodiscard]] const std::vector<std::string>& urdf_joint_names() const noexcept { return urdf_joint_names_; }
  /// Angles of all moving URDF joints for motor angles `r_rad` (targets or measured). @pre r_rad.size() >=
  /// motor_count()
  [[nodiscard]] HandJointAngles urdf_joint_angles(std::span<const double> r_rad) const noexcept;
  /// Robot finger points g(r) in P: [finger][0] tip, [1] middle; NaN for fingers that the hand lacks.
  [[nodiscard]] std::array<std::array<Eigen::Vector3d, 2>, kFingers> finger_points(
      std::span<const double> r_rad) const noexcept;

  [[nodiscard]] const robot::HandKinematics& kinematics() const noexcept { return kinematics_; }

 private:
  // A point that turns with one motor: p(r) = centre + cos(k r) u + sin(k r) v, k the motor's ratio.
  struct Circle {
    Eigen::Vector3d centre{0.0, 0.0, 0.0};  // of the circle, in P
    Eigen::Vector3d u{0.0, 0.0, 0.0};       // radius vector at r = 0
    Eigen::Vector3d v{0.0, 0.0, 0.0};       // radius vector a quarter turn later
    std::size_t motor{robot::kNoIndex};     // kNoIndex: the finger does not exist
  };
  struct Motor {
    double lower_rad{0.0};
    double upper_rad{0.0};
    double ratio{0.0};  // |joint angle per motor angle|; 0: the motor moves no finger point
  };

  explicit EmbodimentMapping(robot::HandKinematics kinematics) : kinematics_(std::move(kinematics)) {}
  Status find_circles(const EmbodimentConfig& config);

  robot::HandKinematics kinematics_;
  Pose X_PM_{Pose::Identity()};
  std::array<std::array<Circle, 2>, kFingers> circles_{};
  std::vector<Motor> motors_;
  std::vector<std::string> motor_names_;
  std::vector<std::string> urdf_joint_names_;
  std::vector<std::size_t> urdf_joints_;  // of the names above, in the model
  std::array<double, kMaxHandJoints> last_rad_{};
};

}  // namespace embody
