#include "daemon/convert/trajectory.hpp"

#include <algorithm>
#include <cmath>

namespace embody::convert {
namespace {

constexpr double kSlowest_hz = 1e-3, kFastest_hz = 1e5;
constexpr double kMostRows = 1e8;
/// Part of a period by which a time may be rounded.
constexpr double kRounding = 1e-6;

/// Row between `a` (s = 0) and `b` (s = 1).
TrajectoryRow between(const TrajectoryRow& a, const TrajectoryRow& b, double s) noexcept {
  TrajectoryRow row;
  row.p_m = (1.0 - s) * a.p_m + s * b.p_m;
  row.orientation = a.orientation.slerp(s, b.orientation).normalized();
  row.valid = a.valid && b.valid;
  return row;
}

void append_joints(const Trajectory& from, std::size_t a, std::size_t b, double s, std::vector<double>& q) {
  const double* q_a = from.joints_of(a);
  const double* q_b = from.joints_of(b);
  for (std::size_t j = 0; j < from.joints.size(); ++j) q.push_back(s == 0.0 ? q_a[j] : (1.0 - s) * q_a[j] + s * q_b[j]);
}

}  // namespace

void set_pose(TrajectoryRow& row, const math::Pose& X) noexcept {
  row.p_m = X.translation();
  row.orientation = Eigen::Quaterniond(X.linear()).normalized();
}

math::Pose pose_of(const TrajectoryRow& row) noexcept {
  math::Pose X = math::Pose::Identity();
  X.linear() = row.orientation.toRotationMatrix();
  X.translation() = row.p_m;
  return X;
}

void make_continuous(Trajectory& trajectory) noexcept {
  Eigen::Quaterniond last = Eigen::Quaterniond::Identity();
  for (TrajectoryRow& row : trajectory.rows) {
    if (!row.orientation.coeffs().allFinite()) continue;
    if (last.dot(row.orientation) < 0.0) row.orientation.coeffs() *= -1.0;
    last = row.orientation;
  }
}

Trajectory slice(const Trajectory& trajectory, std::size_t first, std::size_t last) {
  Trajectory part;
  part.source = trajectory.source;
  part.label = trajectory.label;
  part.hand = trajectory.hand;
  part.object_markers = trajectory.object_markers;
  part.first_frame = trajectory.first_frame + first;
  part.last_frame = trajectory.first_frame + last;
  part.rate_hz = trajectory.rate_hz;
  part.joints = trajectory.joints;
  const auto row = [](std::size_t i) { return static_cast<std::ptrdiff_t>(i); };
  part.rows.assign(trajectory.rows.begin() + row(first), trajectory.rows.begin() + row(last + 1));
  const std::size_t joints = trajectory.joints.size();
  part.q.assign(trajectory.q.begin() + row(first * joints), trajectory.q.begin() + row((last + 1) * joints));
  make_continuous(part);
  return part;
}

Result<Trajectory> resample(const Trajectory& trajectory, double rate_hz) {
  if (!(rate_hz >= kSlowest_hz && rate_hz <= kFastest_hz)) {
    return make_error(Errc::kInvalidArgument, "a rate of %g Hz: it must be between 0.001 and 100,000 Hz", rate_hz);
  }
  if (trajectory.rows.empty()) return make_error(Errc::kInvalidArgument, "the trajectory has no rows to resample");
  const std::vector<TrajectoryRow>& rows = trajectory.rows;
  const double start_s = rows.front().time_s;
  const double periods = (rows.back().time_s - start_s) * rate_hz;
  if (!(periods < kMostRows)) {
    return make_error(Errc::kInvalidArgument, "at %g Hz this trajectory of %.0f s has more than 100 million rows",
                      rate_hz, rows.back().time_s - start_s);
  }
  Trajectory resampled = trajectory;
  resampled.rate_hz = rate_hz;
  resampled.rows.clear();
  resampled.q.clear();
  const auto count = static_cast<std::size_t>(std::floor(periods + kRounding)) + 1;
  resampled.rows.reserve(count);
  resampled.q.reserve(count * trajectory.joints.size());
  std::size_t k = 0;  // the asked time is between rows k and k + 1
  for (std::size_t i = 0; i < count; ++i) {
    const double time_s = start_s + static_cast<double>(i) / rate_hz;
    while (k + 2 < rows.size() && rows[k + 1].time_s <= time_s) ++k;
    const std::size_t next = std::min(k + 1, rows.size() - 1);
    const double period_s = rows[next].time_s - rows[k].time_s;
    const double s = period_s > 0.0 ? (time_s - rows[k].time_s) / period_s : 0.0;
    const bool on_next = s > 1.0 - kRounding;
    if (s < kRounding || on_next) {
      const std::size_t same = on_next ? next : k;
      resampled.rows.push_back(rows[same]);
      append_joints(trajectory, same, same, 0.0, resampled.q);
      continue;
    }
    resampled.rows.push_back(between(rows[k], rows[next], s));
    resampled.rows.back().time_s = time_s;
    append_joints(trajectory, k, next, s, resampled.q);
  }
  make_continuous(resampled);
  return resampled;
}

}  // namespace embody::convert
