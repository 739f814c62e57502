#pragma once
// Smoothing and prediction of finger angles, with a stated lag.
#include "core/hand/hand_model.hpp"

namespace embody::hand {

struct HandStateFilterConfig {
  Duration lag_at_rest{0};    ///< delay of the filter while the finger is still; 0: no filter
  Duration lag_in_motion{0};  ///< that it falls to when a joint moves at `motion_rad_s` or faster; at most lag_at_rest
  double motion_rad_s{0.6};   ///< a third of it still counts as rest
  Duration predict{0};        ///< looks ahead by this known delay; 0: off
  double predict_limit_rad{0.1};  ///< most that a prediction turns a joint by
};

/// Steps once per hand state, in order. Time comes from HandState::t_capture, so the lag does not depend on the frame
/// rate: the gain per step dt is dt / (lag + dt), which follows an angle of constant speed exactly `lag` late, for
/// even and uneven dt (docs/filtering.md). The lag adapts to the speed of the finger's fastest joint, its inverse
/// linear in that speed (the 1-Euro filter's idea; Casiez, Roussel, Vogel 2012, section 3): all joints of a finger have
/// the same lag, so that its tip stays on its path.
class HandStateFilter {
 public:
  /// Settings below zero count as zero.
  HandStateFilter(const HandModel& model, const HandStateFilterConfig& config) noexcept;

  /// Replaces q_rad by the filtered (and predicted) angles and p_M by their points; nothing else changes.
  /// An invalid state passes unchanged and restarts the filter, as do steps in time of more than `kLongestGap`, forward
  /// or back; a state that is not newer gets the last angles. With everything off, states pass bit by bit.
  /// About 2 us, no heap.
  void step(HandState& state) noexcept;

  /// Delay of each finger's joints at the last step, net of prediction (negative: ahead). After a restart it is zero
  /// for one step.
  [[nodiscard]] const std::array<Duration, kFingers>& lag() const noexcept { return lag_; }

  /// Delay of each of the `kSpeedStages` stages in a row that filter the speed. One gives the velocity of predictions;
  /// lag and weight of the prediction come from the last, which marker noise does not move.
  static constexpr Duration kSpeedLag = std::chrono::milliseconds(70);
  static constexpr std::size_t kSpeedStages = 3;
  static constexpr Duration kLongestGap = std::chrono::milliseconds(200);

 private:
  struct Track {
    Track() noexcept { qd_rad_s.fill(Vector9::Zero()); }

    Vector9 q_measured_rad{Vector9::Zero()};     // of the step before
    Vector9 q_rad{Vector9::Zero()};              // filtered
    Vector9 q_out_rad{Vector9::Zero()};          // filtered and predicted
    std::array<Vector9, kSpeedStages> qd_rad_s;  // filtered speed
  };

  void restart(const HandState& state) noexcept;
  void advance(Track& track, const Vector9& q_rad, double dt_s, Duration& lag) const noexcept;
  [[nodiscard]] double lag_s(double speed_rad_s) const noexcept;

  HandModel model_;
  HandStateFilterConfig config_;
  bool off_{true};
  bool started_{false};
  TimePoint t_last_{};
  std::array<Track, kFingers> tracks_;
  std::array<Duration, kFingers> lag_{};
};

}  // namespace embody::hand
