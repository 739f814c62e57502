#pragma once
// One robot finger as a function of the motors that move it: the joints between palm and finger tip, with everything
// that stands still folded into constants. What the embodiment mapping evaluates, some ten times per finger and frame.
#include <span>

#include "core/base/static_vector.hpp"
#include "core/embodiment/embodiment_config.hpp"
#include "core/robot/hand_kinematics.hpp"

namespace embody {

inline constexpr std::size_t kMaxChainJoints = 12;

/// Immutable after create(). P is the root link of the hand.
class RobotFinger {
 public:
  /// A point that moves with one of the joints.
  struct Attachment {
    std::size_t joint{robot::kNoIndex};  ///< of the chain; kNoIndex: fixed in P
    Eigen::Vector3d p_J{0.0, 0.0, 0.0};  ///< in that joint's frame (P if fixed), m
  };
  /// The joints in one configuration.
  struct Posture {
    std::array<Eigen::Matrix3d, kMaxChainJoints> R_PJ;
    std::array<Eigen::Vector3d, kMaxChainJoints> p_PJ;
    std::array<Eigen::Vector3d, kMaxChainJoints> axes_P;  ///< times the coupling's slope: motion per motor unit
  };

  /// Errors: kNotFound (link), kUnsupported (more than kMaxChainJoints joints between palm and tip, a pad or a middle
  /// point on a link that is not between palm and tip).
  [[nodiscard]] static Result<RobotFinger> create(const robot::HandKinematics& hand, const FingerPoints& points);

  [[nodiscard]] const Attachment& tip() const noexcept { return tip_; }
  [[nodiscard]] const Attachment& middle() const noexcept { return middle_; }
  /// Axis of the finger tip's pad; only with has_pad().
  [[nodiscard]] const Attachment& pad_from() const noexcept { return pad_from_; }
  [[nodiscard]] const Attachment& pad_to() const noexcept { return pad_to_; }
  [[nodiscard]] double pad_radius_m() const noexcept { return pad_radius_m_; }
  [[nodiscard]] bool has_pad() const noexcept { return has_pad_; }
  /// Motors that move the finger, without repetition.
  [[nodiscard]] std::span<const std::size_t> motors() const noexcept { return {motors_.begin(), motors_.size()}; }
  /// By joint.
  [[nodiscard]] const robot::Coupling& coupling(std::size_t joint) const noexcept { return joints_[joint].coupling; }
  [[nodiscard]] std::size_t joint_count() const noexcept { return joints_.size(); }

  /// `r`: motor coordinates; `piece`: coordinates inside of the pieces of the couplings whose slopes are wanted (`r`
  /// itself may lie on a knot).
  void update(std::span<const double> r, std::span<const double> piece, Posture& posture) const noexcept;
  /// In P, m.
  [[nodiscard]] Eigen::Vector3d position(const Attachment& point, const Posture& posture) const noexcept;
  /// Motion of a point at `p_P` on the joint of the attachment per unit of the motor of joint `j` (an ancestor), m/rad.
  [[nodiscard]] Eigen::Vector3d motion(std::size_t j, const Eigen::Vector3d& p_P,
                                       const Posture& posture) const noexcept {
    return joints_[j].prismatic ? posture.axes_P[j] : posture.axes_P[j].cross(p_P - posture.p_PJ[j]).eval();
  }
  [[nodiscard]] bool turns(std::size_t joint) const noexcept { return !joints_[joint].prismatic; }

 private:
  struct MovingJoint {
    Eigen::Matrix3d R_parent{Eigen::Matrix3d::Identity()};  // this joint's frame at 0 in the one before (or P)
    Eigen::Vector3d p_parent{0.0, 0.0, 0.0};
    Eigen::Vector3d axis{1.0, 0.0, 0.0};
    robot::Coupling coupling;
    double zero{0.0}, lower{0.0}, upper{0.0};
    bool prismatic{false};
  };

  StaticVector<MovingJoint, kMaxChainJoints> joints_;  // from the palm to the tip
  StaticVector<std::size_t, kMaxChainJoints> motors_;
  Attachment tip_, middle_, pad_from_, pad_to_;
  double pad_radius_m_{0.0};
  bool has_pad_{false};
};

}  // namespace embody
