#pragma once
// The fingers of a robot hand as serial chains, found from the tree of links and joints alone: no name is looked at.
#include <cstddef>
#include <vector>

#include "core/base/result.hpp"
#include "core/robot/urdf_model.hpp"

namespace embody::robot {

/// One value per joint of the model, rad or m.
using JointValues = std::vector<double>;

struct JointRange {
  double lower{0.0};
  double upper{0.0};
};

/// Range of an independent joint in which neither it nor a joint that mimics it leaves its limits. A joint without
/// limits gets +-pi. Where no value suits all (lower > upper), the joint's own limits.
[[nodiscard]] JointRange motor_range(const RobotModel& model, std::size_t joint);

/// Sets every mimic joint from the joint that it follows. @pre q.size() == model.joints.size()
void follow_mimics(const RobotModel& model, JointValues& q);

/// The open hand: every independent joint at the value of its range that is nearest to 0. Robots are drawn with their
/// fingers straight at 0; a hand that is not has to be judged by eye.
[[nodiscard]] JointValues open_posture(const RobotModel& model);

/// X_PL by link, P the root link. @pre q.size() == model.joints.size()
[[nodiscard]] std::vector<math::Pose> link_poses(const RobotModel& model, const JointValues& q);

/// Where a finger's tip was taken from; the URDF's kinematics do not say where the last link ends.
enum class TipRule {
  kLeafFrame,    ///< a link that hangs fixed on the last moving link, at least half a phalanx from the last joint
  kPhalanx,      ///< beyond the last joint, along the last joint-to-joint segment, 0.8 of its length
  kProportions,  ///< one joint or joints in one place: 4.4 spacings of the knuckles long, as in the human middle finger
  kLinkOrigin,   ///< neither direction nor length is known: the last joint itself
};

/// Palm to leaf. Positions are in P, in the open posture.
struct SerialFinger {
  std::vector<std::size_t> joints;         ///< moving joints, palm first
  std::size_t base_link{0};                ///< parent of the first joint
  std::size_t last_link{0};                ///< child of the last joint
  std::size_t tip_link{0};                 ///< `last_link`, or the link fixed to it whose origin is the tip
  Eigen::Vector3d p_tip_L{0.0, 0.0, 0.0};  ///< tip in `tip_link`
  TipRule tip_rule{TipRule::kLinkOrigin};
  /// Index into `joints` of the knuckle: the first joint that turns about (nearly) the same axis as the last one.
  std::size_t knuckle{0};
  Eigen::Vector3d p_knuckle_P{0.0, 0.0, 0.0};
  Eigen::Vector3d p_last_P{0.0, 0.0, 0.0};  ///< last joint
  Eigen::Vector3d p_tip_P{0.0, 0.0, 0.0};
  /// Velocity of the tip per rad when every flexing joint closes, m.
  Eigen::Vector3d v_closing_P{0.0, 0.0, 0.0};
  /// Unit vector about which closing turns the tip round the knuckle, by the right-hand rule; 0: it does not move.
  Eigen::Vector3d closing_axis_P{0.0, 0.0, 0.0};
  bool closing_sure{false};  ///< false: the joints may turn as far either way, and positive was taken for closing

  /// Knuckle to tip, unit vector; 0 when they coincide.
  [[nodiscard]] Eigen::Vector3d direction_P() const {
    const Eigen::Vector3d d = p_tip_P - p_knuckle_P;
    return d.norm() > 1e-6 ? Eigen::Vector3d(d.normalized()) : Eigen::Vector3d(0.0, 0.0, 0.0);
  }
};

struct SerialFingers {
  std::size_t palm_link{0};               ///< last common link of all fingers
  std::vector<std::size_t> wrist_joints;  ///< moving joints before the palm
  std::vector<SerialFinger> fingers;
  /// Branches that are the second bar of a finger's linkage: they lack phalanges and turn in the plane of a finger.
  std::vector<SerialFinger> bars;
};

/// Finds the first rigid body from the root on which two or more moving joints sit (links joined by fixed joints are
/// one body), and one chain for every moving body below it that carries no further moving joint.
/// Errors: kUnsupported (no such body, only one chain is left, or more than 32: this is no hand).
[[nodiscard]] Result<SerialFingers> find_serial_fingers(const RobotModel& model);

}  // namespace embody::robot
