#include "core/hand/calibration_frames.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/hand/hand_pose_estimator.hpp"
#include "core/hand/triad_check.hpp"

namespace embody::hand {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::optional<Vector3d> seen(const MarkerFrame& frame, std::size_t slot) {
  if (slot >= frame.count || slot >= kMaxMarkers || !frame.markers[slot].visible) return std::nullopt;
  if (!frame.markers[slot].p_W.allFinite()) return std::nullopt;
  return frame.markers[slot].p_W;
}

std::optional<Triad> triad(const MarkerFrame& frame, const GloveLayout& glove) {
  Triad p_W;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::optional<Vector3d> p = seen(frame, glove.back_slots[i]);
    if (!p) return std::nullopt;
    p_W[i] = *p;
  }
  Pose X_WH;
  if (!hand_frame(p_W[0], p_W[1], p_W[2], X_WH)) return std::nullopt;
  return p_W;
}

/// The triangle of the given edges in its frame H.
Triad triad_in_H(const TriadEdges& edge) {
  const auto [top_left, top_right, left_right] = edge;
  const double z =
      (top_right * top_right + left_right * left_right - top_left * top_left) / (2.0 * std::max(top_right, 1e-9));
  const double x = std::sqrt(std::max(left_right * left_right - z * z, 0.0));
  return {Vector3d(0.0, 0.0, top_right), Vector3d(x, 0.0, z), Vector3d::Zero()};
}

/// Least-squares pose of the rigid triad on the measured one (Kabsch 1976) and its squared distance.
std::pair<Pose, double> place(const Triad& p_H, const Triad& p_W) {
  Eigen::Matrix3d from, to;
  for (Index i = 0; i < 3; ++i) {
    from.col(i) = p_H[static_cast<std::size_t>(i)];
    to.col(i) = p_W[static_cast<std::size_t>(i)];
  }
  Pose X_WH;
  X_WH.matrix() = Eigen::umeyama(from, to, false);
  return {X_WH, (to - (X_WH * from)).squaredNorm()};
}

constexpr double kFarthestMetres = 0.4;    // of a finger marker from the back of the hand; beyond: a ghost
constexpr double kShapeOffMetres = 0.006;  // beyond: no triad, a swapped or wrong marker

}  // namespace

Result<CalibrationFrames> gather_frames(const std::vector<MarkerFrame>& frames, const GloveLayout& glove) {
  std::array<std::vector<double>, 3> lengths;
  for (const MarkerFrame& frame : frames) {
    const auto p_W = triad(frame, glove);
    if (!p_W) continue;
    const TriadEdges e = edges_of(*p_W);
    for (std::size_t i = 0; i < 3; ++i) lengths[i].push_back(e[i]);
  }
  constexpr std::size_t kFewest = 20;
  if (lengths[0].size() < kFewest) {
    return make_error(Errc::kInvalidArgument,
                      "only %zu of %zu frames show all three markers on the back of the hand; at least %zu are needed: "
                      "keep the back of the hand in view",
                      lengths[0].size(), frames.size(), kFewest);
  }
  CalibrationFrames out;
  for (std::size_t i = 0; i < 3; ++i) out.back_edges_m[i] = median(lengths[i]);
  out.back_H = triad_in_H(out.back_edges_m);
  std::vector<double> off_m2;
  std::size_t bare = 0;
  out.recorded = frames.size();
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const MarkerFrame& frame = frames[k];
    const auto p_W = triad(frame, glove);
    if (!p_W) continue;
    const auto [X_WH, squared_m2] = place(out.back_H, *p_W);
    if (!(squared_m2 < kShapeOffMetres * kShapeOffMetres)) continue;
    CalibrationFrame usable;
    usable.index = k;
    bool any = false;
    const Pose X_HW = X_WH.inverse();
    for (const FingerMarker& marker : glove.finger_markers) {
      auto p = seen(frame, marker.slot);
      if (p) *p = X_HW * *p;
      if (p && !(p->norm() < kFarthestMetres)) p.reset();
      usable.p_H.push_back(p);
      any |= p.has_value();
    }
    if (!any) {
      ++bare;
      continue;
    }
    off_m2.push_back(squared_m2);
    out.frames.push_back(std::move(usable));
  }
  if (out.frames.size() < kFewest) {
    return make_error(Errc::kInvalidArgument,
                      "only %zu of %zu frames are usable (%zu lack a marker on the back of the hand, %zu have one that "
                      "moved against the others, %zu show no finger marker); at least %zu are needed",
                      out.frames.size(), frames.size(), frames.size() - lengths[0].size(),
                      lengths[0].size() - out.frames.size() - bare, bare, kFewest);
  }
  // Nine coordinates less six of the pose: the sum of squares is chi-squared with 3 degrees of freedom, median 2.366.
  out.back_noise_m = std::sqrt(median(off_m2) / 2.366);
  return out;
}

std::vector<CalibrationFrame> thin_out(const std::vector<CalibrationFrame>& frames, std::size_t count) {
  if (frames.size() <= count) return frames;
  constexpr double kLongestStepMetres = 0.03;  // longer ones are gaps, swaps and ghosts
  std::vector<double> travelled_m{0.0};
  for (std::size_t k = 1; k < frames.size(); ++k) {
    double sum = 0.0;
    std::size_t both = 0;
    for (std::size_t i = 0; i < frames[k].p_H.size(); ++i) {
      if (!frames[k].p_H[i] || !frames[k - 1].p_H[i]) continue;
      sum += std::min((*frames[k].p_H[i] - *frames[k - 1].p_H[i]).norm(), kLongestStepMetres);
      ++both;
    }
    travelled_m.push_back(travelled_m.back() + (both == 0 ? 0.0 : sum / static_cast<double>(both)));
  }
  std::vector<CalibrationFrame> out;
  for (std::size_t k = 0; k < frames.size() && out.size() < count; ++k) {
    const double due_m = travelled_m.back() * static_cast<double>(out.size()) / static_cast<double>(count);
    if (travelled_m[k] >= due_m) out.push_back(frames[k]);
  }
  return out;
}

}  // namespace embody::hand
