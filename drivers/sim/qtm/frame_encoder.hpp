#pragma once
// One frame of QTM as a data packet: every component of the protocol 1.8 to 1.28, in either byte order (Qualisys, "QTM
// RT Server Protocol Documentation", data packet). Components that this server has no source for go out with a count
// of zero, as QTM sends them when the measurement has none.
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "core/hal/types.hpp"
#include "drivers/sim/qtm/wire.hpp"

namespace embody::sim {

/// Numbers of the protocol.
enum class Component : std::uint32_t {
  k3d = 1,
  k3dNoLabels = 2,
  kAnalog = 3,
  kForce = 4,
  k6d = 5,
  k6dEuler = 6,
  k2d = 7,
  k2dLinear = 8,
  k3dResidual = 9,
  k3dNoLabelsResidual = 10,
  k6dResidual = 11,
  k6dEulerResidual = 12,
  kAnalogSingle = 13,
  kImage = 14,
  kForceSingle = 15,
  kGazeVector = 16,
  kTimecode = 17,
  kSkeleton = 18,
  kEyeTracker = 19,
};

/// A marker that the identification does not know; the id stays while it is in view.
struct UnlabelledMarker {
  Eigen::Vector3d p_W{0.0, 0.0, 0.0};  ///< m
  std::uint32_t id{0};
};

/// A rigid body; not tracked: all its numbers are NaN on the wire.
struct BodyPose {
  Pose X_WB{Pose::Identity()};
  double residual_m{0.0};
  bool tracked{false};
};

struct FrameData {
  std::uint64_t timestamp_us{0};  ///< since the measurement, or its repetition, started
  std::uint32_t frame_number{0};
  std::uint16_t drop_rate_permille{0};
  std::uint16_t out_of_sync_permille{0};
  double residual_m{0.0};       ///< of every marker
  bool camera_time{false};      ///< component Timecode carries the time of the cameras
  std::vector<Marker> markers;  ///< labelled, in the order of the label list
  std::vector<UnlabelledMarker> unlabelled;
  std::vector<BodyPose> bodies;
};

/// Angles of R = Rx(roll) Ry(pitch) Rz(yaw), rad: QTM's default order of Euler angles.
[[nodiscard]] Eigen::Vector3d roll_pitch_yaw(const Eigen::Matrix3d& R) noexcept;

/// One data packet: millimetres, degrees, rotations column by column, a missing marker with all bits set.
[[nodiscard]] Bytes encode_frame(const FrameData& frame, std::span<const Component> components, ByteOrder order);

}  // namespace embody::sim
