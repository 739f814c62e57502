#pragma once
// Runs the record mapping over recorded frames and collects what it is judged by (docs/evaluate.md).
#include <array>
#include <functional>
#include <string>
#include <vector>

#include "daemon/app/operator_models.hpp"

namespace embody::evaluate {

inline constexpr std::size_t kTimingRuns = 5;

/// One finger marker of the glove.
struct MarkerSamples {
  std::string name;
  Finger finger{Finger::kThumb};
  bool fitted{true};               ///< false: only judged
  std::vector<double> distance_m;  ///< measured to modelled, in each frame that shows it with a valid hand pose
  std::size_t missing{0};          ///< frames with a valid hand pose that do not show it
  std::size_t not_believed{0};     ///< frames in which the estimator rejected or relabelled it; they count above too
};

/// The costliest finger of one frame relative to the reference solver.
struct CostSample {
  std::uint64_t frame_number{0};
  Finger finger{Finger::kThumb};
  double ratio{1.0};
};

/// What one or several recordings showed.
struct RecordSamples {
  std::size_t frames{0};
  std::size_t frames_without_hand{0};  ///< no valid pose of the hand: not judged
  std::vector<MarkerSamples> markers;
  std::size_t finger_frames{0};        ///< those with the finger's tip marker seen in this and in the previous frame
  std::size_t moved{0};                ///< of these: that marker moved by more than 1 mm in the palm's frame
  std::size_t frozen{0};               ///< of these: the modelled marker moved by less than 0.1 mm, no angle at a bound
  std::size_t still_at_bound{0};       ///< the same with an angle pressed against a bound
  std::vector<double> joint_step_rad;  ///< of each of the 15 joints in each frame after a frame
  std::vector<double> transition_step_rad;  ///< a finger's largest, in frames where one of its markers came or went
  std::vector<CostSample> cost;             ///< per frame
  std::array<std::size_t, 6> quality{};     ///< finger-frames by FingerQuality
  std::array<std::vector<double>, kTimingRuns> solve_us;  ///< thread CPU time per frame, run by run

  /// Adds those of another recording with the same markers.
  void add(const RecordSamples& other);
};

struct EvaluationOptions {
  std::vector<std::string> fit;  ///< markers to fit; empty: all finger markers of the glove
  bool reference{true};          ///< compare the costs with SLSQP (slow)
  bool timing{true};             ///< five more runs
  std::function<void(std::size_t done, std::size_t total)> progress;  ///< may be empty
};

/// Steps HandPoseEstimator and FingerEstimator over `frames`, which start the estimators anew. Error
/// (kInvalidArgument): a name in `fit` that is no finger marker of the glove.
[[nodiscard]] Result<RecordSamples> evaluate_record(const OperatorModels& models,
                                                    const std::vector<MarkerFrame>& frames,
                                                    const EvaluationOptions& options);

}  // namespace embody::evaluate
