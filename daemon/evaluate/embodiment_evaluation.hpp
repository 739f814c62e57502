#pragma once
// Runs the embodiment mapping over recorded hand states and collects what it is judged by (docs/evaluate.md).
#include <functional>
#include <string>
#include <vector>

#include "core/embodiment/embodiment_mapping.hpp"
#include "daemon/app/operator_models.hpp"
#include "daemon/evaluate/record_summary.hpp"

namespace embody::evaluate {

/// What one hand did with one or several recordings.
struct EmbodimentSamples {
  std::size_t frames{0};
  std::array<std::vector<double>, kFingers> residual_m;  ///< root mean square distance of the finger's two point pairs
  std::vector<double> joint_step_rad;  ///< largest change of any URDF joint from one frame to the next
  std::vector<double> cost_ratio;      ///< of the costliest group of a frame to SLSQP from the same start
  std::size_t capped{0};               ///< frames with a solve that reached its iteration cap
  std::array<std::vector<double>, kTimingRuns> solve_us;  ///< thread CPU time per frame, run by run

  void add(const EmbodimentSamples& other);
};

struct EmbodimentSummary {
  std::string hand;
  std::size_t frames{0};
  std::array<std::optional<double>, kFingers> residual_mm;  ///< mean
  Quantiles joint_step_deg;
  std::optional<double> cost_p995, cost_max;
  std::size_t costly_frames{0};  ///< above 1.01
  std::size_t capped{0};
  Quantiles solve_us;  ///< each the median of the runs
};

/// The record mapping over all frames, one state per frame (invalid ones included).
[[nodiscard]] std::vector<HandState> hand_states(const OperatorModels& models, const std::vector<MarkerFrame>& frames);

/// Steps a copy of `mapping` over the states. `reference`: compare with SLSQP (slow). `progress` may be empty.
[[nodiscard]] EmbodimentSamples evaluate_embodiment(
    const EmbodimentMapping& mapping, const std::vector<HandState>& states, bool reference,
    const std::function<void(std::size_t done, std::size_t total)>& progress);

[[nodiscard]] EmbodimentSummary summarise(const std::string& hand, const EmbodimentSamples& samples);
/// A table for people, and one JSON object per hand.
[[nodiscard]] std::string embodiment_text(const std::vector<EmbodimentSummary>& summaries);
[[nodiscard]] std::string embodiment_json(const std::vector<EmbodimentSummary>& summaries);

}  // namespace embody::evaluate
