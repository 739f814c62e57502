#include "daemon/evaluate/record_summary.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/evaluate/print.hpp"

namespace embody::evaluate {
namespace {

using nlohmann::ordered_json;

constexpr double kCostly = 1.01;
constexpr std::size_t kMostListed = 20;
constexpr double kDegrees = 180.0 / 3.14159265358979323846;

std::optional<double> mean(const std::vector<double>& values) {
  if (values.empty()) return std::nullopt;
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

std::optional<double> scaled(std::optional<double> value, double factor) {
  if (value) *value *= factor;
  return value;
}

/// Over all markers of a finger that are fitted (or not), each measurement with the same weight.
std::optional<double> finger_mean_mm(const RecordSamples& samples, std::size_t finger, bool fitted) {
  std::vector<double> all;
  for (const MarkerSamples& marker : samples.markers) {
    if (static_cast<std::size_t>(marker.finger) != finger || marker.fitted != fitted) continue;
    all.insert(all.end(), marker.distance_m.begin(), marker.distance_m.end());
  }
  return scaled(mean(all), 1e3);
}

std::optional<double> median_of_runs(const RecordSamples& samples, double q) {
  std::vector<double> runs;
  for (const auto& run : samples.solve_us) {
    if (const auto value = quantile(run, q); value) runs.push_back(*value);
  }
  return quantile(runs, 0.5);
}

ordered_json per_finger(const std::array<std::optional<double>, kFingers>& values) {
  ordered_json object;
  for (std::size_t f = 0; f < kFingers; ++f) object[kFingerNames[f]] = json_number(values[f]);
  return object;
}

}  // namespace

std::optional<double> quantile(std::vector<double> values, double q) {
  if (values.empty()) return std::nullopt;
  const double rank = std::ceil(q * static_cast<double>(values.size())) - 1.0;
  const auto index = std::min(values.size() - 1, static_cast<std::size_t>(std::max(0.0, rank)));
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(index);
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

RecordSummary summarise(const RecordSamples& samples) {
  RecordSummary summary;
  summary.frames = samples.frames;
  summary.frames_without_hand = samples.frames_without_hand;
  for (const MarkerSamples& marker : samples.markers) {
    summary.markers.push_back({marker.name, marker.finger, marker.fitted, scaled(mean(marker.distance_m), 1e3),
                               scaled(quantile(marker.distance_m, 0.95), 1e3), marker.missing, marker.not_believed});
  }
  for (std::size_t f = 0; f < kFingers; ++f) {
    summary.residual_mm[f] = finger_mean_mm(samples, f, true);
    summary.unseen_mm[f] = finger_mean_mm(samples, f, false);
  }
  summary.finger_frames = samples.finger_frames;
  summary.moved = samples.moved;
  summary.frozen = samples.frozen;
  summary.still_at_bound = samples.still_at_bound;
  if (samples.moved > 0) {
    summary.frozen_fraction = static_cast<double>(samples.frozen) / static_cast<double>(samples.moved);
  }
  const auto steps = [&samples](double q) { return scaled(quantile(samples.joint_step_rad, q), kDegrees); };
  summary.joint_step_deg = {steps(0.5), steps(0.99), steps(1.0)};
  summary.transitions = samples.transition_step_rad.size();
  summary.transition_step_deg = scaled(quantile(samples.transition_step_rad, 1.0), kDegrees);
  std::vector<double> ratios;
  for (const CostSample& sample : samples.cost) {
    ratios.push_back(sample.ratio);
    if (sample.ratio > kCostly) summary.costly.push_back(sample);
  }
  summary.costly_frames = summary.costly.size();
  summary.cost_p995 = quantile(ratios, 0.995);
  summary.cost_max = quantile(ratios, 1.0);
  summary.quality = samples.quality;
  summary.solve_us = {median_of_runs(samples, 0.5), median_of_runs(samples, 0.99), median_of_runs(samples, 1.0)};
  return summary;
}

std::string summary_text(const RecordSummary& s) {
  std::string text;
  print(text, "frames                 %zu judged, %zu without a valid pose of the hand\n",
        s.frames - s.frames_without_hand, s.frames_without_hand);
  print(text, "%-22s %8s %8s %8s %8s %12s\n", "marker", "used as", "mean mm", "p95 mm", "missing", "not believed");
  for (const MarkerFigures& m : s.markers) {
    print(text, "  %-20.20s %8s %8s %8s %8zu %12zu\n", m.name.c_str(), m.fitted ? "fit" : "judge",
          number(m.mean_mm, "%.2f").c_str(), number(m.p95_mm, "%.2f").c_str(), m.missing, m.not_believed);
  }
  print(text, "%-22s", "finger");
  for (const char* name : kFingerNames) print(text, " %8s", name);
  print(text, "\n%-22s", "  residual mm");
  for (const auto& value : s.residual_mm) print(text, " %8s", number(value, "%.2f").c_str());
  print(text, "\n%-22s", "  unseen mm");
  for (const auto& value : s.unseen_mm) print(text, " %8s", number(value, "%.2f").c_str());
  print(text,
        "\nfrozen fingers         %s %%: %zu of %zu finger-frames whose tip marker moved by more than 1 mm (of %zu); "
        "%zu more at a bound\n",
        number(scaled(s.frozen_fraction, 100.0), "%.3f").c_str(), s.frozen, s.moved, s.finger_frames, s.still_at_bound);
  print(text, "joint step deg/frame   p50 %s, p99 %s, max %s; %s where a marker came or went (%zu times)\n",
        number(s.joint_step_deg.p50, "%.3f").c_str(), number(s.joint_step_deg.p99, "%.2f").c_str(),
        number(s.joint_step_deg.max, "%.2f").c_str(), number(s.transition_step_deg, "%.2f").c_str(), s.transitions);
  print(text, "finger-frames          %zu converged, %zu at a bound, %zu at the iteration cap, %zu held, %zu lost\n",
        s.quality[1], s.quality[4], s.quality[2], s.quality[3], s.quality[0] + s.quality[5]);
  if (s.cost_max) {
    print(text, "cost / SLSQP           p99.5 %s, max %s; above 1.01 in %zu frames\n",
          number(s.cost_p995, "%.4f").c_str(), number(s.cost_max, "%.4f").c_str(), s.costly_frames);
    for (std::size_t i = 0; i < std::min(kMostListed, s.costly.size()); ++i) {
      const CostSample& c = s.costly[i];
      print(text, "  frame %llu %s %.4f\n", static_cast<unsigned long long>(c.frame_number),
            kFingerNames[static_cast<std::size_t>(c.finger)], c.ratio);
    }
    if (s.costly.size() > kMostListed) print(text, "  and %zu more\n", s.costly.size() - kMostListed);
  }
  print(text, "five fingers us        p50 %s, p99 %s, max %s (thread CPU time, median of %zu runs)\n",
        number(s.solve_us.p50, "%.1f").c_str(), number(s.solve_us.p99, "%.1f").c_str(),
        number(s.solve_us.max, "%.1f").c_str(), kTimingRuns);
  return text;
}

std::string summary_json(const RecordSummary& s) {
  ordered_json object{{"frames", s.frames}, {"frames_without_hand", s.frames_without_hand}};
  object["residual_mm"] = per_finger(s.residual_mm);
  object["unseen_mm"] = per_finger(s.unseen_mm);
  object["markers_mm"] = ordered_json::object();
  object["markers_fitted"] = ordered_json::array();
  for (const MarkerFigures& marker : s.markers) {
    object["markers_mm"][marker.name] = json_number(marker.mean_mm);
    if (marker.fitted) object["markers_fitted"].push_back(marker.name);
  }
  const auto quantiles = [](const Quantiles& q) {
    return ordered_json{{"p50", json_number(q.p50)}, {"p99", json_number(q.p99)}, {"max", json_number(q.max)}};
  };
  object["frozen_fraction"] = json_number(s.frozen_fraction);
  object["frozen"] = {{"finger_frames", s.finger_frames},
                      {"moved", s.moved},
                      {"frozen", s.frozen},
                      {"still_at_bound", s.still_at_bound}};
  object["joint_step_deg"] = quantiles(s.joint_step_deg);
  object["transitions"] = s.transitions;
  object["transition_step_deg"] = json_number(s.transition_step_deg);
  object["cost_ratio"] = {{"p995", json_number(s.cost_p995)}, {"max", json_number(s.cost_max)}};
  object["costly_frames"] = s.costly_frames;
  object["solve_us"] = quantiles(s.solve_us);
  object["quality"] = {{"none", s.quality[0]}, {"optimal", s.quality[1]},  {"capped", s.quality[2]},
                       {"held", s.quality[3]}, {"at_limit", s.quality[4]}, {"lost", s.quality[5]}};
  return object.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace embody::evaluate
