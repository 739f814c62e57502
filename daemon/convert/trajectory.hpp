#pragma once
// A motion of a robot hand in time: where its root link is and how its joints stand.
#include <Eigen/Geometry>
#include <limits>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/math/pose.hpp"

namespace embody::convert {

/// A joint of the robot hand, or a motor before the joints are computed.
struct JointColumn {
  std::string name;
  bool prismatic{false};  ///< its values are lengths (m), not angles (rad)
};

/// The hand at one time. The pose is NaN as long as nothing is known of it.
struct TrajectoryRow {
  double time_s{0.0};  ///< since the first frame of the recording
  Eigen::Vector3d p_m{Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN())};
  Eigen::Quaterniond orientation{Eigen::Vector4d::Constant(std::numeric_limits<double>::quiet_NaN())};
  bool valid{false};  ///< false: nothing was measured, pose and joints are the last known ones
};

/// Poses are of the hand's root link P in W (motion-capture world), or in O (object) when `object_markers` are named:
/// p_m its origin, orientation its unit quaternion, whose sign never jumps from row to row.
struct Trajectory {
  std::string source;  ///< recording, for people
  std::string label;   ///< of the segment; empty: none
  std::string hand;    ///< name of the robot hand
  std::vector<std::string> object_markers;
  std::size_t first_frame{0};  ///< of the recording, counted from 1
  std::size_t last_frame{0};
  double rate_hz{0.0};  ///< rows per second
  std::vector<JointColumn> joints;
  std::vector<TrajectoryRow> rows;
  std::vector<double> q;  ///< row by row one value per joint, rad or m

  [[nodiscard]] const double* joints_of(std::size_t row) const noexcept { return q.data() + row * joints.size(); }
  [[nodiscard]] double* joints_of(std::size_t row) noexcept { return q.data() + row * joints.size(); }
};

/// Sets position and orientation of the row.
void set_pose(TrajectoryRow& row, const math::Pose& X) noexcept;
[[nodiscard]] math::Pose pose_of(const TrajectoryRow& row) noexcept;

/// Chooses the sign of each quaternion such that it is the nearer one to that of the row before; the first has w >= 0.
void make_continuous(Trajectory& trajectory) noexcept;

/// Rows `first` to `last` (indices, both included). @pre first <= last < rows.size()
[[nodiscard]] Trajectory slice(const Trajectory& trajectory, std::size_t first, std::size_t last);

/// The trajectory at times t_0 + i / rate_hz up to the last row: straight lines for position and joints, the shortest
/// rotation (slerp) for the orientation. Times of the trajectory itself give its own rows unchanged. A row between two
/// others is valid when both are. Nothing is extrapolated. Errors: kInvalidArgument (rate outside of 0.001 to
/// 100,000 Hz, no row, more than 100 million rows).
[[nodiscard]] Result<Trajectory> resample(const Trajectory& trajectory, double rate_hz);

}  // namespace embody::convert
