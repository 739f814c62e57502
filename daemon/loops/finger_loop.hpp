#pragma once
// Newest marker frame in, robot finger angles out. Slow frames cost this loop only: the arm never waits for it.
#include "core/embodiment/embodiment_mapping.hpp"
#include "core/hand/finger_estimator.hpp"
#include "core/hand/hand_state_filter.hpp"
#include "daemon/loops/edges.hpp"

namespace embody {

/// Diagnosis: extra time per frame, to show that the arm does not depend on this loop.
struct SlowDown {
  Duration time{0};
  bool spins{false};  ///< compute instead of sleep
};

class FingerLoop {
 public:
  FingerLoop(const hand::FingerEstimator& estimator, const hand::HandStateFilter& filter,
             const EmbodimentMapping& mapping, const SlowDown& slow_down, Edges& edges)
      : estimator_(estimator), filter_(filter), mapping_(mapping), edges_(edges) {
    set_slow_down(slow_down);
  }
  /// Until edges.stop. No heap, lock, log or exception.
  void run() noexcept;
  /// Any thread.
  void set_slow_down(const SlowDown& slow_down) noexcept {
    slow_down_ns_.store(slow_down.spins ? -slow_down.time.count() : slow_down.time.count(), std::memory_order_relaxed);
  }

 private:
  static constexpr Duration kDutyWindow = std::chrono::milliseconds(100);

  void use(const TrackedFrame& tracked) noexcept;
  void slow_down(TimePoint t_start) const noexcept;
  [[nodiscard]] bool duty_exceeded(TimePoint now) noexcept;

  hand::FingerEstimator estimator_;
  hand::HandStateFilter filter_;
  EmbodimentMapping mapping_;
  std::atomic<Duration::rep> slow_down_ns_{0};  // negative: spin
  Edges& edges_;
  FingerReport report_;
  std::uint64_t last_sequence_{0};
  TimePoint t_window_{};
  Duration busy_{0};
};

}  // namespace embody
