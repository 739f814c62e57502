#pragma once
// The figures that people and programs read of an evaluation (docs/evaluate.md).
#include <optional>
#include <string>

#include "daemon/evaluate/record_evaluation.hpp"

namespace embody::evaluate {

/// `q` in 0..1: the smallest value that at least that share of `values` does not exceed; nothing of an empty list.
[[nodiscard]] std::optional<double> quantile(std::vector<double> values, double q);

struct Quantiles {
  std::optional<double> p50, p99, max;
};

struct MarkerFigures {
  std::string name;
  Finger finger{Finger::kThumb};
  bool fitted{true};
  std::optional<double> mean_mm;
  std::optional<double> p95_mm;
  std::size_t missing{0};
  std::size_t not_believed{0};
};

struct RecordSummary {
  std::size_t frames{0};
  std::size_t frames_without_hand{0};
  std::vector<MarkerFigures> markers;
  std::array<std::optional<double>, kFingers> residual_mm;  ///< mean over the finger's fitted markers and all frames
  std::array<std::optional<double>, kFingers> unseen_mm;    ///< the same of markers that were left out of the fit
  std::size_t finger_frames{0};
  std::size_t moved{0};
  std::size_t frozen{0};
  std::size_t still_at_bound{0};
  std::optional<double> frozen_fraction;  ///< frozen / moved
  Quantiles joint_step_deg;
  std::size_t transitions{0};
  std::optional<double> transition_step_deg;  ///< largest
  std::optional<double> cost_p995, cost_max;
  std::size_t costly_frames{0};    ///< above 1.01
  std::vector<CostSample> costly;  ///< those frames in order
  std::array<std::size_t, 6> quality{};
  Quantiles solve_us;  ///< each the median of the runs
};

[[nodiscard]] RecordSummary summarise(const RecordSamples& samples);

/// A table for people.
[[nodiscard]] std::string summary_text(const RecordSummary& summary);

/// One JSON object; null where there is no figure.
[[nodiscard]] std::string summary_json(const RecordSummary& summary);

}  // namespace embody::evaluate
