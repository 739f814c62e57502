#include "daemon/simlab/follow_report.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/embodiment/arm_target.hpp"
#include "core/robot/ur_kinematics.hpp"

namespace embody::sim {
namespace {

constexpr Duration kLagStep = std::chrono::milliseconds(2);
constexpr Duration kTolerance = std::chrono::milliseconds(500);
constexpr Duration kGrid = std::chrono::milliseconds(10);  // at which the plants are compared

/// Frame of `recording` in the slots of the glove.
MarkerFrame to_marker_frame(const recording::Recording& recording, std::size_t index,
                            const std::vector<std::size_t>& columns) {
  MarkerFrame frame;
  frame.frame_number = index + 1;
  frame.count = columns.size();
  for (std::size_t slot = 0; slot < columns.size(); ++slot) {
    frame.markers[slot] = recording.frames[index][columns[slot]];
  }
  return frame;
}

/// Column of each glove marker; the caller has checked that all exist.
std::vector<std::size_t> columns_of(const hand::GloveLayout& glove, const recording::Recording& recording) {
  std::vector<std::size_t> columns;
  for (const auto& name : glove.names) {
    const auto& names = recording.marker_names;
    columns.push_back(static_cast<std::size_t>(std::find(names.begin(), names.end(), name.view()) - names.begin()));
  }
  return columns;
}

double percentile_95(std::vector<double>& values) {
  if (values.empty()) return std::numeric_limits<double>::infinity();
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 95 / 100);
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

/// Index of the last element with t <= `t`, or 0.
template <class T>
std::size_t before(const std::vector<T>& samples, TimePoint t) {
  const auto after =
      std::upper_bound(samples.begin(), samples.end(), t, [](TimePoint a, const T& b) { return a < b.t; });
  return after == samples.begin() ? 0 : static_cast<std::size_t>(after - samples.begin()) - 1;
}

/// Target at `t`, linear between frames.
TargetSample target_at(const std::vector<TargetSample>& targets, TimePoint t) {
  const std::size_t i = before(targets, t);
  if (i + 1 >= targets.size() || t <= targets[i].t) return targets[i];
  const TargetSample& a = targets[i];
  const TargetSample& b = targets[i + 1];
  const double s = to_seconds(t - a.t) / to_seconds(b.t - a.t);
  TargetSample target{t, math::interpolate(a.X_BE, b.X_BE, s), {}};
  for (std::size_t k = 0; k < target.q_hand_rad.size(); ++k) {
    target.q_hand_rad[k] = a.q_hand_rad[k] + s * (b.q_hand_rad[k] - a.q_hand_rad[k]);
  }
  return target;
}

struct Actual {
  TimePoint t{};
  Pose X_BE{Pose::Identity()};
};

/// The flange on a 10 ms grid within [begin, end].
std::vector<Actual> flange_path(const std::vector<UrSample>& arm, const robot::UrGeometry& geometry, TimePoint begin,
                                TimePoint end) {
  std::vector<Actual> path;
  TimePoint next = begin;
  for (const UrSample& sample : arm) {
    if (sample.t < next || sample.t > end) continue;
    path.push_back({sample.t, robot::forward_kinematics(sample.q_rad, geometry)});
    next = sample.t + kGrid - kGrid / 4;
  }
  return path;
}

void judge_arm(const std::vector<TargetSample>& targets, const std::vector<Actual>& path,
               const FollowCriteria& criteria, FollowReport& report) {
  double best = std::numeric_limits<double>::infinity();
  std::vector<double> distance(path.size());
  std::vector<double> angle(path.size());
  for (Duration lag{0}; lag <= criteria.largest_lag; lag += kLagStep) {
    double target_length = 0.0;
    double length = 0.0;
    Pose last = Pose::Identity();
    for (std::size_t i = 0; i < path.size(); ++i) {
      const Pose X_BEt = target_at(targets, path[i].t - lag).X_BE;
      distance[i] = (path[i].X_BE.translation() - X_BEt.translation()).norm();
      angle[i] = math::angle_between(path[i].X_BE.linear(), X_BEt.linear());
      if (i > 0) {
        target_length += (X_BEt.translation() - last.translation()).norm();
        length += (path[i].X_BE.translation() - path[i - 1].X_BE.translation()).norm();
      }
      last = X_BEt;
    }
    const double error_m = percentile_95(distance);
    const double error_rad = percentile_95(angle);
    const double score = std::max(error_m / criteria.arm_p95_m, error_rad / criteria.arm_p95_rad);
    if (score >= best) continue;
    best = score;
    report.arm_lag_s = to_seconds(lag);
    report.arm_error_m = error_m;
    report.arm_error_rad = error_rad;
    report.path_ratio = target_length > 0.0 ? length / target_length : 0.0;
  }
}

void judge_hand(const std::vector<TargetSample>& targets, const std::vector<HandSample>& hand, TimePoint begin,
                TimePoint end, const FollowCriteria& criteria, FollowReport& report) {
  report.hand_error_rad = std::numeric_limits<double>::infinity();
  std::vector<double> errors;
  for (Duration lag{0}; lag <= criteria.largest_lag; lag += kLagStep) {
    errors.clear();
    for (const HandSample& sample : hand) {
      if (sample.t < begin || sample.t > end) continue;
      const TargetSample target = target_at(targets, sample.t - lag);
      double error = 0.0;
      for (std::size_t k = 0; k < sample.count; ++k) {
        error = std::max(error, std::abs(sample.q_rad[k] - target.q_hand_rad[k]));
      }
      errors.push_back(error);
    }
    const double error = percentile_95(errors);
    if (error >= report.hand_error_rad) continue;
    report.hand_error_rad = error;
    report.hand_lag_s = to_seconds(lag);
  }
}

void judge_engagement(const std::vector<UrSample>& arm, TimePoint begin, TimePoint end, FollowReport& report) {
  std::size_t all = 0;
  std::size_t tracking = 0;
  for (const UrSample& sample : arm) {
    if (sample.t < begin || sample.t > end) continue;
    ++all;
    if (sample.program_state == ProgramState::kTracking) ++tracking;
    report.largest_joint_speed_rad_s =
        std::max(report.largest_joint_speed_rad_s, sample.qd_rad_s.cwiseAbs().maxCoeff());
  }
  report.engaged_fraction = all > 0 ? static_cast<double>(tracking) / static_cast<double>(all) : 0.0;
}

std::string first_failure(const FollowReport& report, const FollowCriteria& c) {
  const auto exceeds = [](const char* what, double value, double limit, const char* unit) {
    char text[160];
    std::snprintf(text, sizeof text, "%s is %.3f %s, allowed are %.3f %s", what, value, unit, limit, unit);
    return std::string(text);
  };
  if (report.first_tracking_s > to_seconds(c.start_within)) {
    return exceeds("time until the arm tracked", report.first_tracking_s, to_seconds(c.start_within), "s");
  }
  if (report.engaged_fraction < c.engaged_min) {
    return exceeds("time without tracking", 1.0 - report.engaged_fraction, 1.0 - c.engaged_min, "of the judged time");
  }
  if (!(report.arm_error_m <= c.arm_p95_m)) {
    return exceeds("arm position error (p95)", report.arm_error_m * 1e3, c.arm_p95_m * 1e3, "mm");
  }
  if (!(report.arm_error_rad <= c.arm_p95_rad)) {
    return exceeds("arm orientation error (p95)", report.arm_error_rad, c.arm_p95_rad, "rad");
  }
  if (!(report.hand_error_rad <= c.hand_p95_rad)) {
    return exceeds("hand joint error (p95)", report.hand_error_rad, c.hand_p95_rad, "rad");
  }
  if (report.path_ratio < c.path_ratio_min || report.path_ratio > c.path_ratio_max) {
    return exceeds("path length", report.path_ratio, report.path_ratio < 1 ? c.path_ratio_min : c.path_ratio_max,
                   "of the target's");
  }
  return "";
}

}  // namespace

std::vector<TargetSample> ungated_targets(const Models& models, const recording::Recording& recording,
                                          const std::vector<SentFrame>& sent) {
  Models m = models;
  const std::vector<std::size_t> columns = columns_of(m.glove, recording);
  std::vector<TargetSample> targets;
  HandState state;
  FingerTarget fingers;
  for (const SentFrame& frame : sent) {
    const MarkerFrame markers = to_marker_frame(recording, frame.index, columns);
    const HandPose pose = m.hand_pose.step(markers);
    if (!pose.valid) continue;
    m.fingers.step(markers, pose, state);
    m.embodiment.step(state, fingers);
    targets.push_back({frame.t_sent, arm_target(m.arm.X_BW, pose.X_WM, m.arm.X_PM, m.arm.X_EP), fingers.q_rad});
  }
  return targets;
}

FollowReport judge(const std::vector<TargetSample>& targets, const std::vector<UrSample>& arm,
                   const std::vector<HandSample>& hand, const FollowCriteria& criteria) {
  FollowReport report;
  if (targets.empty()) {
    report.reason = "no frame was sent";
    return report;
  }
  const TimePoint t_start = targets.front().t;
  const auto first = std::find_if(arm.begin(), arm.end(), [&](const UrSample& sample) {
    return sample.t >= t_start && sample.program_state == ProgramState::kTracking;
  });
  if (first == arm.end()) {
    report.reason = "the arm never tracked";
    return report;
  }
  report.first_tracking_s = to_seconds(first->t - t_start);
  const TimePoint begin = first->t + criteria.settle;
  const TimePoint end = targets.back().t;
  if (end - begin < std::chrono::seconds(1)) {
    report.reason = "less than a second is left to be judged";
    return report;
  }
  report.judged_s = to_seconds(end - begin);
  if (criteria.planned - (end - t_start) > kTolerance) {
    report.reason = "the recording was not sent to its end: the tracker's connection was lost";
    return report;
  }
  if (arm.back().t < end - kTolerance || hand.empty() || hand.back().t < end - kTolerance) {
    report.reason = "the log of the simulated robot ends before the recording";
    return report;
  }
  judge_engagement(arm, begin, end, report);
  judge_arm(targets, flange_path(arm, criteria.arm, begin, end), criteria, report);
  judge_hand(targets, hand, begin, end, criteria, report);
  report.reason = first_failure(report, criteria);
  report.followed = report.reason.empty();
  return report;
}

}  // namespace embody::sim
