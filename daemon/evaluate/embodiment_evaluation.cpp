#include "daemon/evaluate/embodiment_evaluation.hpp"

#include <algorithm>
#include <cmath>

#include "core/hand/hand_pose_estimator.hpp"
#include "daemon/evaluate/print.hpp"
#include "daemon/evaluate/samples.hpp"

namespace embody::evaluate {
namespace {

constexpr double kCostly = 1.01;
constexpr double kLeastCost_m2 = 1e-9;
constexpr double kDegrees = 180.0 / 3.14159265358979323846;

std::optional<double> scaled(std::optional<double> value, double factor) {
  if (value) *value *= factor;
  return value;
}

/// Same problems, same starts: what the reference solver makes of them.
double worst_ratio(const EmbodimentMapping& mapping) {
  constexpr int kEvaluations = 2000;
  constexpr double kTolerance = 1e-14;
  double worst = 0.0;
  for (const HandGroup& group : mapping.groups()) {
    if (!group.solution.valid) continue;
    HandProblem problem = mapping.problem(group);
    const HandSolution best =
        solve_slsqp(problem, {group.ranges.begin(), group.ranges.size()}, group.start, kEvaluations, kTolerance);
    if (!best.valid) continue;
    worst = std::max(worst, std::max(group.solution.cost_m2, kLeastCost_m2) / std::max(best.cost_m2, kLeastCost_m2));
  }
  return worst;
}

std::optional<double> median_of_runs(const EmbodimentSamples& samples, double q) {
  std::vector<double> runs;
  for (const auto& run : samples.solve_us) {
    if (const auto value = quantile(run, q); value) runs.push_back(*value);
  }
  return quantile(runs, 0.5);
}

}  // namespace

void EmbodimentSamples::add(const EmbodimentSamples& other) {
  frames += other.frames;
  capped += other.capped;
  for (std::size_t f = 0; f < kFingers; ++f) append(residual_m[f], other.residual_m[f]);
  append(joint_step_rad, other.joint_step_rad);
  append(cost_ratio, other.cost_ratio);
  for (std::size_t i = 0; i < kTimingRuns; ++i) append(solve_us[i], other.solve_us[i]);
}

std::vector<HandState> hand_states(const OperatorModels& models, const std::vector<MarkerFrame>& frames) {
  hand::HandPoseEstimator pose(models.layout, models.X_HM);
  hand::FingerEstimator fingers(models.hand_model(), models.layout, models.fingers);
  std::vector<HandState> states(frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) fingers.step(frames[i], pose.step(frames[i]), states[i]);
  return states;
}

EmbodimentSamples evaluate_embodiment(const EmbodimentMapping& mapping, const std::vector<HandState>& states,
                                      bool reference,
                                      const std::function<void(std::size_t done, std::size_t total)>& progress) {
  EmbodimentSamples samples;
  EmbodimentMapping judged = mapping;
  FingerTarget target;
  std::optional<HandJointAngles> last;
  for (std::size_t i = 0; i < states.size(); ++i) {
    judged.step(states[i], target);
    if (progress) progress(i + 1, states.size());
    if (!target.valid) continue;
    ++samples.frames;
    for (std::size_t f = 0; f < kFingers; ++f) {
      if (!mapping.config().fingers[f].link.empty()) samples.residual_m[f].push_back(target.residual_m[f]);
    }
    const HandJointAngles angles = judged.urdf_joint_angles(target.q_rad);
    double step = 0.0;
    for (std::size_t j = 0; last && j < angles.count; ++j) {
      step = std::max(step, std::abs(angles.q_rad[j] - last->q_rad[j]));
    }
    if (last) samples.joint_step_rad.push_back(step);
    last = angles;
    const bool capped = std::any_of(judged.groups().begin(), judged.groups().end(),
                                    [](const HandGroup& group) { return !group.solution.converged; });
    samples.capped += capped ? 1 : 0;
    if (reference) samples.cost_ratio.push_back(worst_ratio(judged));
  }
  for (auto& times_us : samples.solve_us) {
    EmbodimentMapping timed = mapping;
    times_us.reserve(states.size());
    for (const HandState& state : states) {
      const Duration t_start = thread_time();
      timed.step(state, target);
      times_us.push_back(1e6 * to_seconds(thread_time() - t_start));
    }
  }
  return samples;
}

EmbodimentSummary summarise(const std::string& hand, const EmbodimentSamples& samples) {
  EmbodimentSummary summary;
  summary.hand = hand;
  summary.frames = samples.frames;
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (samples.residual_m[f].empty()) continue;
    double sum = 0.0;
    for (const double value : samples.residual_m[f]) sum += value;
    summary.residual_mm[f] = 1e3 * sum / static_cast<double>(samples.residual_m[f].size());
  }
  const auto steps = [&samples](double q) { return scaled(quantile(samples.joint_step_rad, q), kDegrees); };
  summary.joint_step_deg = {steps(0.5), steps(0.99), steps(1.0)};
  summary.cost_p995 = quantile(samples.cost_ratio, 0.995);
  summary.cost_max = quantile(samples.cost_ratio, 1.0);
  summary.costly_frames = static_cast<std::size_t>(std::count_if(samples.cost_ratio.begin(), samples.cost_ratio.end(),
                                                                 [](double ratio) { return ratio > kCostly; }));
  summary.capped = samples.capped;
  summary.solve_us = {median_of_runs(samples, 0.5), median_of_runs(samples, 0.99), median_of_runs(samples, 1.0)};
  return summary;
}

std::string embodiment_text(const std::vector<EmbodimentSummary>& summaries) {
  std::string text;
  print(text, "%-16s %6s", "mean error mm", "frames");
  for (const char* name : kFingerNames) print(text, " %7s", name);
  print(text, "\n");
  for (const EmbodimentSummary& s : summaries) {
    print(text, "  %-14.14s %6zu", s.hand.c_str(), s.frames);
    for (const auto& value : s.residual_mm) print(text, " %7s", number(value, "%.2f").c_str());
    print(text, "\n");
  }
  print(text, "%-16s %8s %8s %8s  %10s %8s %7s %7s  %8s %8s %8s\n", "", "step p50", "p99", "max deg", "cost p99.5",
        "max", "> 1.01", "capped", "us p50", "p99", "max");
  for (const EmbodimentSummary& s : summaries) {
    print(text, "  %-14.14s %8s %8s %8s  %10s %8s %7zu %7zu  %8s %8s %8s\n", s.hand.c_str(),
          number(s.joint_step_deg.p50, "%.3f").c_str(), number(s.joint_step_deg.p99, "%.2f").c_str(),
          number(s.joint_step_deg.max, "%.2f").c_str(), number(s.cost_p995, "%.4f").c_str(),
          number(s.cost_max, "%.4f").c_str(), s.costly_frames, s.capped, number(s.solve_us.p50, "%.1f").c_str(),
          number(s.solve_us.p99, "%.1f").c_str(), number(s.solve_us.max, "%.1f").c_str());
  }
  return text;
}

std::string embodiment_json(const std::vector<EmbodimentSummary>& summaries) {
  nlohmann::ordered_json object = nlohmann::ordered_json::object();
  const auto quantiles = [](const Quantiles& q) {
    return nlohmann::ordered_json{
        {"p50", json_number(q.p50)}, {"p99", json_number(q.p99)}, {"max", json_number(q.max)}};
  };
  for (const EmbodimentSummary& s : summaries) {
    nlohmann::ordered_json hand{{"frames", s.frames}};
    for (std::size_t f = 0; f < kFingers; ++f) hand["residual_mm"][kFingerNames[f]] = json_number(s.residual_mm[f]);
    hand["joint_step_deg"] = quantiles(s.joint_step_deg);
    hand["cost_ratio"] = {{"p995", json_number(s.cost_p995)}, {"max", json_number(s.cost_max)}};
    hand["costly_frames"] = s.costly_frames;
    hand["capped_frames"] = s.capped;
    hand["solve_us"] = quantiles(s.solve_us);
    object[s.hand] = std::move(hand);
  }
  return object.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace embody::evaluate
