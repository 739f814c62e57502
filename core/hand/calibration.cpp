#include "core/hand/calibration.hpp"

#include <algorithm>
#include <cmath>

#include "core/hand/calibration_advice.hpp"
#include "core/hand/calibration_problem.hpp"

namespace embody::hand {
namespace {

using Eigen::Index;

/// Simulated calibrations are off by more than the linearised posterior says, the turn of the hand (large angles) most.
constexpr double kStatedOverLinear = 1.3, kStatedTurnOverLinear = 2.0;
constexpr double kPriorOnly = 0.9;
constexpr std::size_t kFewestFrames = 20, kMostFrames = 2000;

Status check_glove(const GloveLayout& glove, const HandPoints& points) {
  if (glove.finger_markers.empty()) {
    return make_error(Errc::kInvalidArgument, "the glove has no finger markers: there is nothing to calibrate");
  }
  std::array<std::size_t, kFingers> count{};
  for (std::size_t i = 0; i < glove.finger_markers.size(); ++i) {
    const FingerMarker& marker = glove.finger_markers[i];
    const auto f = static_cast<std::size_t>(marker.finger);
    if (f >= kFingers || marker.slot >= kMaxMarkers || marker.point >= points[f].size()) {
      return make_error(Errc::kInvalidArgument,
                        "finger marker %zu of the glove: finger %zu, slot %zu or point %zu does not exist", i, f,
                        marker.slot, marker.point);
    }
    if (++count[f] > kMaxFingerPoints - 2) {
      return make_error(Errc::kInvalidArgument, "the glove has more than %zu markers on the %s finger",
                        kMaxFingerPoints - 2, kFingerNames[f]);
    }
  }
  return {};
}

Status check_options(const Pose& X_HM, const CalibrationOptions& options) {
  const CalibrationPrior& prior = options.prior;
  const auto positive = [](double value) { return value > 0.0 && std::isfinite(value); };
  bool sound = positive(prior.marker_sd_m) && positive(prior.X_HM_translation_sd_m) &&
               positive(prior.X_HM_rotation_sd_rad) && positive(prior.noise_sd_m);
  for (Index i = 0; i < prior.shape_sd.size(); ++i) sound &= positive(prior.shape_sd(i));
  if (!sound) {
    return make_error(Errc::kInvalidArgument, "the prior of the calibration: standard deviations must be positive");
  }
  if (!math::is_valid(X_HM)) {
    return make_error(Errc::kInvalidArgument, "the nominal pose X_HM of the hand under its back markers is no pose");
  }
  return {};
}

double mean_distance_m(const CalibrationProblem& problem, const CalibrationVariables& at, std::size_t marker) {
  double sum_m = 0.0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < at.frames.size(); ++k) {
    const std::optional<double> d = problem.distance_m(at, k, marker);
    if (!d || problem.loss().weight(*d * *d) <= 0.5) continue;
    sum_m += *d;
    ++count;
  }
  return count == 0 ? 0.0 : sum_m / static_cast<double>(count);
}

Calibration result(CalibrationProblem& problem, const CalibrationVariables& at) {
  const Eigen::VectorXd prior_sd = problem.prior_sd();
  Eigen::VectorXd sd = kStatedOverLinear * problem.certainty(at).sd;
  sd.segment<3>(CalibrationProblem::kPoseBegin) *= kStatedTurnOverLinear / kStatedOverLinear;
  sd = sd.cwiseMin(prior_sd);
  Calibration out;
  out.shape = at.shape;
  out.shape_sd = sd.head<10>();
  for (Index i = 0; i < out.shape.size(); ++i) {
    out.shape_prior_only[static_cast<std::size_t>(i)] = sd(i) > kPriorOnly * prior_sd(i);
  }
  out.X_HM = at.X_HM;
  out.X_HM_sd = sd.segment<6>(CalibrationProblem::kPoseBegin);
  out.back_edges_m = problem.frames().back_edges_m;
  out.frames_used = problem.frames().frames.size();
  for (std::size_t m = 0; m < problem.markers().size(); ++m) {
    const CalibrationMarker& known = problem.markers()[m];
    const Index first = CalibrationProblem::kPlacesBegin + 3 * static_cast<Index>(m);
    CalibratedMarker marker;
    marker.slot = known.slot;
    marker.finger = known.finger;
    marker.joint = known.joint;
    marker.offset_m = at.offset_m[m];
    marker.sd_m = sd.segment<3>(first);
    marker.prior_only = (marker.sd_m.array() > kPriorOnly * prior_sd.segment<3>(first).array()).all();
    marker.residual_m = mean_distance_m(problem, at, m);
    out.markers.push_back(marker);
  }
  return out;
}

}  // namespace

Result<Calibration> calibrate(const std::vector<MarkerFrame>& frames, const GloveLayout& glove, const HandData& data,
                              const HandPoints& points, const Pose& X_HM, const CalibrationOptions& options) {
  if (const Status checked = check_points(data, points); !checked) return checked.error();
  if (const Status checked = check_glove(glove, points); !checked) return checked.error();
  if (const Status checked = check_options(X_HM, options); !checked) return checked.error();
  Result<CalibrationFrames> gathered = gather_frames(frames, glove);
  if (!gathered) return gathered.error();
  gathered->frames = thin_out(gathered->frames, std::clamp(options.max_frames, kFewestFrames, kMostFrames));

  CalibrationProblem problem(data, glove, points, X_HM, options.prior, *gathered);
  CalibrationVariables at = problem.nominal();
  solve(problem, at, options);
  Calibration out = result(problem, at);
  advise(problem, at, glove, options.prior, out);
  return out;
}

CalibratedGlove apply(const Calibration& calibration, const GloveLayout& glove, const HandPoints& points) {
  CalibratedGlove out{glove, points};
  out.glove.back_edges_m = calibration.back_edges_m;
  for (FingerMarker& marker : out.glove.finger_markers) {
    const auto f = static_cast<std::size_t>(marker.finger);
    if (f >= kFingers) continue;
    const auto of_marker = [&marker](const CalibratedMarker& known) {
      return known.slot == marker.slot && known.finger == marker.finger;
    };
    const auto known = std::find_if(calibration.markers.begin(), calibration.markers.end(), of_marker);
    if (known == calibration.markers.end()) continue;
    HandPoint point;
    point.joint = known->joint;
    point.offset_m = known->offset_m;
    if (marker.point >= 2 && marker.point < out.points[f].size()) {
      out.points[f][marker.point] = point;
    } else if (out.points[f].push_back(point)) {
      marker.point = out.points[f].size() - 1;
    }
  }
  return out;
}

}  // namespace embody::hand
