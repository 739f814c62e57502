#pragma once
// Newest marker frame in, robot finger angles out. Slow frames cost this loop only: the arm never waits for it.
#include "core/embodiment/embodiment_mapping.hpp"
#include "core/hand/finger_estimator.hpp"
#include "daemon/loops/edges.hpp"

namespace embody {

struct FingerLoopConfig {
  Duration slow_down{0};  ///< diagnosis: extra time per frame
  bool slow_down_spins{false};
};

class FingerLoop {
 public:
  FingerLoop(const hand::FingerEstimator& estimator, const EmbodimentMapping& mapping, const FingerLoopConfig& config,
             Edges& edges)
      : estimator_(estimator), mapping_(mapping), config_(config), edges_(edges) {}
  /// Until edges.stop. No heap, lock, log or exception.
  void run() noexcept;

 private:
  static constexpr Duration kDutyWindow = std::chrono::milliseconds(100);

  void use(const TrackedFrame& tracked) noexcept;
  void slow_down(TimePoint t_start) const noexcept;
  [[nodiscard]] bool duty_exceeded(TimePoint now) noexcept;

  hand::FingerEstimator estimator_;
  EmbodimentMapping mapping_;
  FingerLoopConfig config_;
  Edges& edges_;
  FingerReport report_;
  std::uint64_t last_sequence_{0};
  TimePoint t_window_{};
  Duration busy_{0};
};

}  // namespace embody
