#include "daemon/evaluate/record_evaluation.hpp"

#include <algorithm>
#include <optional>

#include "core/hand/hand_pose_estimator.hpp"
#include "daemon/evaluate/samples.hpp"

namespace embody::evaluate {
namespace {

using Eigen::Vector3d;
using hand::Vector9;

constexpr double kMoved_m = 0.001;
constexpr double kStill_m = 0.0001;
constexpr double kLeastCost_m2 = 1e-9;
constexpr int kReferenceEvaluations = 5000;
constexpr double kReferenceTolerance = 1e-14;

bool seen(const MarkerFrame& frame, std::size_t slot) noexcept {
  return slot < frame.count && frame.markers[slot].visible && frame.markers[slot].p_W.allFinite();
}

Vector9 angles(const HandState& state, std::size_t finger) {
  return state.q_rad.segment<9>(static_cast<Eigen::Index>(kFingerOffset[finger]));
}

bool solved(FingerQuality quality) noexcept {
  return quality == FingerQuality::kOptimal || quality == FingerQuality::kCapped || quality == FingerQuality::kAtLimit;
}

/// Per finger the fitted marker that is farthest from the knuckle in the flat hand; -1: the finger has none.
std::array<int, kFingers> tip_markers(const hand::HandModel& model, const hand::GloveLayout& layout,
                                      const std::vector<MarkerSamples>& samples) {
  std::array<int, kFingers> tips;
  std::array<double, kFingers> reach_m{};
  tips.fill(-1);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const hand::FingerMarker& marker = layout.finger_markers[i];
    const auto f = static_cast<std::size_t>(marker.finger);
    const Vector3d p_M = model.point(marker.finger, marker.point, model.chain(marker.finger, Vector9::Zero()));
    const double distance_m = (p_M - model.rest_joints()[hand::first_joint(marker.finger)]).norm();
    if (!samples[i].fitted || (tips[f] >= 0 && distance_m <= reach_m[f])) continue;
    tips[f] = static_cast<int>(i);
    reach_m[f] = distance_m;
  }
  return tips;
}

/// One pass over the frames.
class Pass {
 public:
  Pass(const OperatorModels& models, const hand::GloveLayout& fitted, RecordSamples& samples)
      : layout_(models.layout),
        pose_(models.layout, models.X_HM),
        fingers_(models.hand_model(), fitted, models.fingers),
        samples_(samples),
        tips_(tip_markers(fingers_.model(), layout_, samples.markers)),
        modelled_M_(samples.markers.size(), Vector3d::Zero()),
        measured_M_(samples.markers.size()) {}

  void step(const MarkerFrame& frame, bool reference) {
    const HandPose pose = pose_.step(frame);
    fingers_.step(frame, pose, state_);
    ++samples_.frames;
    const bool continues = usable_;
    usable_ = state_.valid;
    if (!usable_) {
      ++samples_.frames_without_hand;
      return;
    }
    judge_markers(frame);
    if (continues) judge_motion();
    if (reference) judge_cost();
    for (const FingerQuality quality : state_.quality) ++samples_.quality[static_cast<std::size_t>(quality)];
    previous_ = state_;
    previous_modelled_M_ = modelled_M_;
    previous_measured_M_ = measured_M_;
  }

 private:
  void judge_markers(const MarkerFrame& frame) {
    const Pose X_MW = state_.X_WM.inverse();
    std::array<hand::FingerChain, kFingers> chains;
    for (std::size_t f = 0; f < kFingers; ++f) {
      chains[f] = fingers_.model().chain(static_cast<Finger>(f), angles(state_, f));
    }
    for (std::size_t i = 0; i < samples_.markers.size(); ++i) {
      const hand::FingerMarker& marker = layout_.finger_markers[i];
      const auto f = static_cast<std::size_t>(marker.finger);
      MarkerSamples& sample = samples_.markers[i];
      modelled_M_[i] = fingers_.model().point(marker.finger, marker.point, chains[f]);
      measured_M_[i].reset();
      if (!seen(frame, marker.slot)) {
        ++sample.missing;
        continue;
      }
      measured_M_[i] = X_MW * frame.markers[marker.slot].p_W;
      sample.distance_m.push_back((*measured_M_[i] - modelled_M_[i]).norm());
      if (sample.fitted && fingers_.markers().verdict[marker.slot] != hand::MarkerVerdict::kUsed) ++sample.not_believed;
    }
  }

  void judge_motion() {
    for (std::size_t f = 0; f < kFingers; ++f) {
      double largest = 0.0;
      for (Eigen::Index j = 0; j < 9; j += 3) {
        const double step = math::angle_between(math::exp_so3(angles(previous_, f).segment<3>(j)),
                                                math::exp_so3(angles(state_, f).segment<3>(j)));
        samples_.joint_step_rad.push_back(step);
        largest = std::max(largest, step);
      }
      if (marker_came_or_went(f)) samples_.transition_step_rad.push_back(largest);
      judge_freeze(f);
    }
  }

  bool marker_came_or_went(std::size_t finger) const {
    for (std::size_t i = 0; i < samples_.markers.size(); ++i) {
      const MarkerSamples& sample = samples_.markers[i];
      const bool own = sample.fitted && static_cast<std::size_t>(sample.finger) == finger;
      if (own && measured_M_[i].has_value() != previous_measured_M_[i].has_value()) return true;
    }
    return false;
  }

  void judge_freeze(std::size_t finger) {
    if (tips_[finger] < 0) return;
    const auto tip = static_cast<std::size_t>(tips_[finger]);
    if (!measured_M_[tip] || !previous_measured_M_[tip]) return;
    ++samples_.finger_frames;
    if ((*measured_M_[tip] - *previous_measured_M_[tip]).norm() <= kMoved_m) return;
    ++samples_.moved;
    if ((modelled_M_[tip] - previous_modelled_M_[tip]).norm() >= kStill_m) return;
    ++(state_.quality[finger] == FingerQuality::kAtLimit ? samples_.still_at_bound : samples_.frozen);
  }

  /// Same problem, same start: what the reference solver makes of it.
  void judge_cost() {
    CostSample worst{state_.frame_number, Finger::kThumb, 0.0};
    for (std::size_t f = 0; f < kFingers; ++f) {
      const hand::FingerProblem& problem = fingers_.problem(static_cast<Finger>(f));
      if (problem.markers.empty() || !solved(state_.quality[f])) continue;
      const hand::FingerSolution best = solve_slsqp(problem, kReferenceEvaluations, kReferenceTolerance);
      if (best.status == hand::SolveStatus::kInvalid) continue;
      const double ratio =
          std::max(problem.cost(angles(state_, f)), kLeastCost_m2) / std::max(best.cost_m2, kLeastCost_m2);
      if (ratio > worst.ratio) worst = {state_.frame_number, static_cast<Finger>(f), ratio};
    }
    if (worst.ratio > 0.0) samples_.cost.push_back(worst);
  }

  const hand::GloveLayout& layout_;  // fitted and judged markers
  hand::HandPoseEstimator pose_;
  hand::FingerEstimator fingers_;
  RecordSamples& samples_;
  std::array<int, kFingers> tips_;
  HandState state_;
  HandState previous_;
  bool usable_{false};
  std::vector<Vector3d> modelled_M_;
  std::vector<Vector3d> previous_modelled_M_;
  std::vector<std::optional<Vector3d>> measured_M_;
  std::vector<std::optional<Vector3d>> previous_measured_M_;
};

std::vector<double> time_run(const OperatorModels& models, const hand::GloveLayout& fitted,
                             const std::vector<MarkerFrame>& frames) {
  hand::HandPoseEstimator pose_estimator(models.layout, models.X_HM);
  hand::FingerEstimator fingers(models.hand_model(), fitted, models.fingers);
  std::vector<double> times_us;
  times_us.reserve(frames.size());
  HandState state;
  for (const MarkerFrame& frame : frames) {
    const HandPose pose = pose_estimator.step(frame);
    const Duration t_start = thread_time();
    fingers.step(frame, pose, state);
    times_us.push_back(1e6 * to_seconds(thread_time() - t_start));
  }
  return times_us;
}

}  // namespace

void RecordSamples::add(const RecordSamples& other) {
  frames += other.frames;
  frames_without_hand += other.frames_without_hand;
  if (markers.empty()) {
    markers = other.markers;
  } else {
    for (std::size_t i = 0; i < markers.size(); ++i) {
      append(markers[i].distance_m, other.markers[i].distance_m);
      markers[i].missing += other.markers[i].missing;
      markers[i].not_believed += other.markers[i].not_believed;
    }
  }
  finger_frames += other.finger_frames;
  moved += other.moved;
  frozen += other.frozen;
  still_at_bound += other.still_at_bound;
  append(joint_step_rad, other.joint_step_rad);
  append(transition_step_rad, other.transition_step_rad);
  append(cost, other.cost);
  for (std::size_t i = 0; i < quality.size(); ++i) quality[i] += other.quality[i];
  for (std::size_t i = 0; i < kTimingRuns; ++i) append(solve_us[i], other.solve_us[i]);
}

Result<RecordSamples> evaluate_record(const OperatorModels& models, const std::vector<MarkerFrame>& frames,
                                      const EvaluationOptions& options) {
  const hand::GloveLayout& layout = models.layout;
  RecordSamples samples;
  for (const hand::FingerMarker& marker : layout.finger_markers) {
    MarkerSamples& sample = samples.markers.emplace_back();
    sample.name = layout.names[marker.slot].view();
    sample.finger = marker.finger;
    sample.fitted = options.fit.empty();
  }
  for (const std::string& name : options.fit) {
    const auto found = std::find_if(samples.markers.begin(), samples.markers.end(),
                                    [&name](const MarkerSamples& sample) { return sample.name == name; });
    if (found == samples.markers.end()) {
      return make_error(Errc::kInvalidArgument, "'%.60s' is no finger marker of the glove", name.c_str());
    }
    found->fitted = true;
  }
  hand::GloveLayout fitted = layout;
  fitted.finger_markers.clear();
  for (std::size_t i = 0; i < samples.markers.size(); ++i) {
    if (samples.markers[i].fitted) fitted.finger_markers.push_back(layout.finger_markers[i]);
  }

  Pass pass(models, fitted, samples);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    pass.step(frames[i], options.reference);
    if (options.progress) options.progress(i + 1, frames.size());
  }
  for (std::size_t run = 0; options.timing && run < kTimingRuns; ++run) {
    samples.solve_us[run] = time_run(models, fitted, frames);
  }
  return samples;
}

}  // namespace embody::evaluate
