#pragma once
// Finger angles of the human hand from the markers on the fingers: the optimisation half of the record mapping.
#include "core/hal/types.hpp"
#include "core/hand/glove_layout.hpp"
#include "core/hand/hand_model.hpp"

namespace embody::hand {

struct FingerEstimatorConfig {
  using PerFinger = std::array<Vector9, kFingers>;  ///< by Finger; joint by joint x, y, z

  PerFinger lower_rad;     ///< default -0.4 pi
  PerFinger upper_rad;     ///< default +0.4 pi
  PerFinger weight_plus;   ///< m/rad: cost of a positive angle q is (w q)^2
  PerFinger weight_minus;  ///< m/rad: cost of a negative angle
  int max_iterations{50};
  double tolerance{1e-9};  ///< first-order optimality of half the cost in the box, m^2/rad

  /// Bounds and action weights of Fabisch et al. 2022 (published configuration 20211105_april).
  FingerEstimatorConfig() noexcept;
};

/// Steps once per marker frame. Five independent problems; for finger i with the visible markers j
///   min_q sum_j ||p_j - f_ij(q)||^2 + ||max(w+ o q, 0)||^2 + ||min(w- o q, 0)||^2,  lower <= q <= upper
/// (Fabisch et al. 2022, section "Record Mapping"), each started from its last solution.
/// Angles that no visible marker of the finger depends on (the end joints while only the middle marker is seen) keep
/// their values.
class FingerEstimator {
 public:
  FingerEstimator(const HandModel& model, const GloveLayout& glove, const FingerEstimatorConfig& config) noexcept;

  /// Fills all of `state` except t_estimated. A finger without a visible marker keeps its angles (kHeld). With an
  /// invalid hand pose everything is held and `state.valid` is false. No heap; bounded by max_iterations.
  void step(const MarkerFrame& frame, const HandPose& hand_pose, HandState& state) noexcept;

  /// Iterations of each finger's last solve; 0 when it was held or already optimal.
  [[nodiscard]] const std::array<int, kFingers>& iterations() const noexcept { return iterations_; }

 private:
  void solve(std::size_t finger, const std::array<const Marker*, 2>& markers, const Pose& X_MW,
             HandState& state) noexcept;
  void hold(std::size_t finger, HandState& state) noexcept;

  HandModel model_;
  FingerEstimatorConfig config_;
  std::array<std::array<std::size_t, 2>, kFingers> slots_;  ///< kMaxMarkers: the glove has no such marker
  std::array<Vector9, kFingers> q_rad_;
  std::array<bool, kFingers> known_{};
  std::array<double, kFingers> residual_m_{};
  std::array<int, kFingers> iterations_{};
};

}  // namespace embody::hand
