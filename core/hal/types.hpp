#pragma once
// The plain values that travel along the data path. Fixed capacity, default member initialisers, SI units.
// Default-constructed means "nothing known": not visible, not valid, time "never".
#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "core/base/fixed_string.hpp"
#include "core/base/time.hpp"
#include "core/hal/hand_telemetry.hpp"
#include "core/math/pose.hpp"

namespace embody {

using math::Pose;
using math::Vector6;

inline constexpr std::size_t kMaxMarkers = 64;
inline constexpr std::size_t kMaxHandJoints = 32;
inline constexpr std::size_t kFingers = 5;
inline constexpr std::size_t kFingerAngles = 9;  ///< three joints of three axis-angle components
inline constexpr std::size_t kHandAngles = 45;

/// Index into every per-finger array.
enum class Finger : std::uint8_t { kThumb, kIndex, kMiddle, kRing, kLittle };
inline constexpr std::array<const char*, kFingers> kFingerNames{"thumb", "index", "middle", "ring", "little"};

/// First element of each finger in MANO's 45 finger angles (order index, middle, little, ring, thumb).
inline constexpr std::array<std::size_t, kFingers> kFingerOffset{36, 0, 9, 27, 18};

/// Which hand of the person.
enum class Side : std::uint8_t { kRight, kLeft };
inline constexpr std::array<const char*, 2> kSideNames{"right", "left"};

struct Marker {
  Eigen::Vector3d p_W{0.0, 0.0, 0.0};  ///< m; meaningless unless visible
  bool visible{false};
  float confidence{1.0F};  ///< 0..1 for sensors that tell how sure they are
};

/// Pose of a rigid body that the sensor tracks by itself.
struct RigidBody {
  Pose X_W{Pose::Identity()};  ///< of the body in the motion-capture world; meaningless unless visible
  double residual_m{0.0};      ///< how far its markers are from their known places, mean; 0 when the sensor tells none
  bool visible{false};
};

/// One measurement of the tracker. `markers[i]` is the i-th name of the configured glove layout, whatever the sensor's
/// order; a landmark tracker fills the 21 slots of core/hand/landmark_layout.hpp.
struct MarkerFrame {
  std::uint64_t frame_number{0};  ///< the sensor's own count; may restart
  std::uint32_t label_epoch{0};   ///< changes when the sensor's label list changed
  TimePoint t_capture{};          ///< exposure, mapped to CLOCK_MONOTONIC
  TimePoint t_arrival{};          ///< bytes read from the kernel
  std::size_t count{0};
  std::array<Marker, kMaxMarkers> markers{};
  RigidBody body;  ///< on the back of the hand, where the sensor is told to track one; not visible otherwise
};

/// Pose of the hand in the motion-capture world: the cheap half of the record mapping.
struct HandPose {
  std::uint64_t sequence{0};  ///< counts estimates since start, without gaps
  std::uint64_t frame_number{0};
  TimePoint t_capture{};
  TimePoint t_arrival{};
  TimePoint t_decoded{};        ///< frame decoded
  TimePoint t_estimated{};      ///< pose computed
  Pose X_WH{Pose::Identity()};  ///< frame of the three markers on the back of the hand
  Pose X_WM{Pose::Identity()};  ///< base of the hand model
  bool valid{false};            ///< false: the poses are the last valid ones
  double fit_error_m{0.0};      ///< how far the back of the hand is from its known shape, root mean square
  std::uint32_t streak{0};      ///< valid, plausible poses in a row up to this one, without a gap in time
  std::uint32_t jumps{0};       ///< times that a sudden but lasting change of pose was accepted
};

enum class FingerQuality : std::uint8_t {
  kNone,     ///< no estimate yet
  kOptimal,  ///< converged on this frame's markers
  kCapped,   ///< iteration cap reached; best point so far
  kHeld,     ///< no usable marker of this finger; angles of an earlier frame
  kAtLimit,  ///< converged, with an angle pressed against its bound
  kLost,     ///< held for too long: the angles decay towards the resting hand
};

[[nodiscard]] inline std::array<std::array<Eigen::Vector3d, 2>, kFingers> zero_points() noexcept {
  std::array<std::array<Eigen::Vector3d, 2>, kFingers> points;  // Eigen leaves value-initialised vectors unset
  for (auto& finger : points) finger.fill(Eigen::Vector3d::Zero());
  return points;
}

/// State of the human hand in MANO's parametrisation.
struct HandState {
  std::uint64_t frame_number{0};
  TimePoint t_capture{};
  TimePoint t_arrival{};
  TimePoint t_estimated{};
  Pose X_WM{Pose::Identity()};
  Eigen::Matrix<double, static_cast<int>(kHandAngles), 1> q_rad{
      Eigen::Matrix<double, static_cast<int>(kHandAngles), 1>::Zero()};  ///< axis-angle, MANO's order
  /// Model points that correspond to the markers, in M (m): [finger][0] tip, [finger][1] middle.
  std::array<std::array<Eigen::Vector3d, 2>, kFingers> p_M = zero_points();
  /// Last phalanx of each finger in M, m: [0] its joint, [1] its tip.
  std::array<std::array<Eigen::Vector3d, 2>, kFingers> distal_M = zero_points();
  std::array<double, kFingers> residual_m{};  ///< mean distance of visible markers to their model points
  std::array<std::uint8_t, kFingers> visible_markers{};
  std::array<FingerQuality, kFingers> quality{};
  std::array<double, kFingers> confidence{};  ///< 0 (nothing known) .. 1 (all markers seen and explained)
  double hand_confidence{0.0};                ///< the least of the back of the hand and the fingers with markers
  bool valid{false};
};

/// Robot finger angles in the order of the hand driver's joint names.
struct FingerTarget {
  std::uint64_t frame_number{0};
  TimePoint t_capture{};
  TimePoint t_arrival{};
  TimePoint t_solved{};
  std::size_t joint_count{0};
  std::array<double, kMaxHandJoints> q_rad{};
  std::array<double, kFingers> residual_m{};  ///< root mean square distance of the finger's point pairs
  /// 0..1, by joint: the least confidence of the human fingers that the joint follows.
  std::array<double, kMaxHandJoints> joint_confidence{};
  double hand_confidence{0.0};  ///< 0..1, in the pose of the back of the human hand
  bool valid{false};
};

enum class ArmCondition : std::uint8_t {
  kUnknown,
  kReady,           ///< may move
  kNotRunning,      ///< not powered, brakes on, booting
  kProgramStopped,  ///< robot fine, control program not running
  kProtectiveStop,
  kEmergencyStop,
  kFault,
};

/// What the arm's controller said in one package.
struct ArmState {
  std::uint64_t package{0};  ///< counts packages of this connection
  Duration controller_time{0};
  TimePoint t_arrival{};
  Vector6 q_rad{Vector6::Zero()};
  Vector6 qd_rad_s{Vector6::Zero()};
  Vector6 q_target_rad{Vector6::Zero()};  ///< the controller's own set-point
  ArmCondition condition{ArmCondition::kUnknown};
  bool tracking{false};            ///< the robot's control program follows our targets
  std::int32_t program_fault{0};   ///< reason code of the control program, 0 = none
  std::uint32_t echo_sequence{0};  ///< newest command sequence the program has seen
  std::int32_t robot_mode{0};      ///< vendor codes, for display
  std::int32_t safety_status{0};
  double speed_scaling{1.0};
};

enum class ArmAction : std::uint8_t {
  kHold,   ///< disarm: stand still, ignore targets
  kTrack,  ///< follow q, qd
  kExit,   ///< end the control program
};

struct ArmCommand {
  std::uint32_t sequence{0};
  ArmAction action{ArmAction::kHold};
  Vector6 q_rad{Vector6::Zero()};
  Vector6 qd_rad_s{Vector6::Zero()};
  TimePoint t_capture{};  ///< of the measurement that this command answers
  TimePoint t_expires{};  ///< a driver refuses the command after this
};

struct HandDeviceState {
  std::uint64_t reply{0};  ///< counts position replies of this connection
  TimePoint t_arrival{};
  std::size_t joint_count{0};
  std::array<double, kMaxHandJoints> q_rad{};
  HandTelemetry telemetry;  ///< as of this reply
};

enum class HandAction : std::uint8_t {
  kHold,  ///< send nothing that moves; poll the positions
  kMove,
  kStop,  ///< stop all motors now
};

struct HandCommand {
  std::uint32_t sequence{0};
  HandAction action{HandAction::kHold};
  std::size_t joint_count{0};
  std::array<double, kMaxHandJoints> q_rad{};
  TimePoint t_capture{};
  TimePoint t_expires{};
};

}  // namespace embody
