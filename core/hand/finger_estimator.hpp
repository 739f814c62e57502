#pragma once
// Finger angles of the human hand from the markers on the fingers: the optimisation half of the record mapping.
#include <optional>

#include "core/hand/confidence.hpp"
#include "core/hand/finger_problem.hpp"
#include "core/hand/glove_layout.hpp"
#include "core/hand/marker_guard.hpp"

namespace embody::hand {

struct FingerEstimatorConfig {
  using PerFinger = std::array<Vector9, kFingers>;  ///< by Finger; joint by joint x, y, z, of a right hand

  PerFinger lower_rad;  ///< anatomical range
  PerFinger upper_rad;
  PerFinger weight_plus;     ///< m/rad: cost of a positive angle q is (w q)^2
  PerFinger weight_minus;    ///< m/rad: cost of a negative angle
  PerFinger temporal_m_rad;  ///< cost of a change since the last frame
  double coupling_m_rad{0.0};
  double coupling_ratio{2.0 / 3.0};
  FingerObjective objective{FingerObjective::kPaper};
  FingerSolver solver{FingerSolver::kOwn};
  int max_iterations{30};
  double tolerance{1e-9};  ///< first-order optimality of half the cost in the box, m^2/rad
  /// Greatest joint speed after the set of visible markers changed, until the fit has caught up, rad/s.
  double catch_up_rad_s{8.7};
  Duration hold{std::chrono::milliseconds(600)};    ///< a finger without markers keeps its angles for this long,
  Duration decay{std::chrono::milliseconds(1000)};  ///< then returns to the flat hand with this time constant
  double least_confidence{0.0};  ///< a measurement of which the sensor is less sure counts as missing
  bool trust_labels{false};      ///< of the sensor: no label swaps, ghosts or steps to look for (landmark trackers)
  MarkerGuardConfig guard;
  ConfidenceScale confidence;

  /// Our prior: anatomical ranges, even weights (the thumb's are those of Fabisch et al. 2022), coupling, temporal
  /// term.
  FingerEstimatorConfig() noexcept;
  /// Weights of Fabisch et al. 2022 (published configuration 20211105_april) and its bounds of +-0.4 pi, without any
  /// prior, for the paper's objective; the published implementation also has `objective` kPublished.
  [[nodiscard]] static FingerEstimatorConfig published() noexcept;
};

/// Steps once per marker frame: five independent FingerProblems, each started from its last solution. Angles that no
/// usable marker of the finger depends on (the end joints while only the middle marker is seen) keep their values. A
/// tip is reached with the middle joint bent or overstretched; a finger that got stuck overstretched is tried bent, and
/// led there when that fits better.
class FingerEstimator {
 public:
  FingerEstimator(const HandModel& model, const GloveLayout& glove, const FingerEstimatorConfig& config) noexcept;

  /// Fills all of `state` except t_estimated. A finger without a usable marker keeps its angles (kHeld), then decays
  /// (kLost). With an invalid hand pose everything is held and `state.valid` is false. No heap with the own solver;
  /// bounded by max_iterations.
  void step(const MarkerFrame& frame, const HandPose& hand_pose, HandState& state) noexcept;

  /// What became of each marker of the last frame.
  [[nodiscard]] const CheckedMarkers& markers() const noexcept { return checked_; }
  /// Confidence in the pose of the back of the hand, on which everything else rests: 0..1.
  [[nodiscard]] double back_confidence(const HandPose& hand_pose) const noexcept {
    return hand_confidence(hand_pose.valid, hand_pose.fit_error_m, {}, {}, config_.confidence);
  }
  /// How far the glove has slipped (MarkerGuard::slip_m), m.
  [[nodiscard]] double slip_m() const noexcept { return guard_.slip_m(); }
  /// Iterations of each finger's last solve; 0 when it was held or already optimal.
  [[nodiscard]] const std::array<int, kFingers>& iterations() const noexcept { return iterations_; }
  /// Iterations of the bent posture that was tried in the last step; 0 when none was.
  [[nodiscard]] int unfold_iterations() const noexcept { return unfold_iterations_; }
  /// The problem that the last step solved for `finger`; markers empty when it was held. For reference solvers.
  [[nodiscard]] const FingerProblem& problem(Finger finger) const noexcept {
    return problems_[static_cast<std::size_t>(finger)];
  }
  [[nodiscard]] const HandModel& model() const noexcept { return model_; }

 private:
  struct FingerMemory {
    Vector9 q_rad{Vector9::Zero()};
    FingerChain chain;  // for q_rad
    bool known{false};
    bool catching_up{false};
    std::optional<double> unfold_to_rad;  // flexion of the middle joint in a better posture, on the way there
    std::uint64_t seen{0};                // which measurements made the last fit
    std::uint64_t seen_now{0};            // and which make this one
    Duration unseen{0};                   // since the last fit
    double residual_m{0.0};
    double cost_m2{0.0};
  };

  [[nodiscard]] Duration step_time(TimePoint t_capture) noexcept;
  void trust(const MarkerFrame& frame, const HandPose& hand_pose) noexcept;
  void explain() noexcept;
  void answer(const MarkerTrial& trial) noexcept;
  void unfold() noexcept;
  void unfold(std::size_t finger) noexcept;
  /// Flexion is positive in a right hand, negative in a left one.
  [[nodiscard]] double side_sign() const noexcept { return model_.side() == Side::kRight ? 1.0 : -1.0; }
  [[nodiscard]] bool overstretched(std::size_t finger) const noexcept;
  void rate(const HandPose& hand_pose, HandState& state) const noexcept;
  void gather(const MarkerFrame& frame) noexcept;
  void prepare(std::size_t finger, Duration dt) noexcept;
  void solve(std::size_t finger, HandState& state) noexcept;
  void hold(std::size_t finger, Duration dt, HandState& state) noexcept;

  HandModel model_;
  GloveLayout glove_;
  FingerEstimatorConfig config_;
  MarkerGuard guard_;
  CheckedMarkers checked_;
  std::array<std::size_t, kFingers> carried_{};  // markers that the glove has on each finger
  std::array<FingerMemory, kFingers> memory_;
  std::array<FingerProblem, kFingers> problems_;
  std::array<int, kFingers> iterations_{};
  std::size_t unfold_next_{0};
  int unfold_iterations_{0};
  TimePoint t_last_{};
};

}  // namespace embody::hand
