#pragma once
// The operator of the fault matrix: a hand that swings to and fro and opens and closes, for ever, twice a second at its
// greatest speed. Pure.
#include <vector>

#include "core/hand/hand_model.hpp"
#include "core/hand/landmark_layout.hpp"
#include "drivers/sim/qtm/motion.hpp"

namespace embody::faults {

class OperatorMotion {
 public:
  OperatorMotion();

  /// Where the markers of paper_glove() are at this time, in W (m).
  [[nodiscard]] std::vector<Eigen::Vector3d> markers(double t_s) const;
  /// Where a landmark tracker sees the 21 landmarks, in W (m).
  [[nodiscard]] std::array<Eigen::Vector3d, hand::kLandmarks> landmarks(double t_s) const;

 private:
  struct Posture {
    Pose X_WM;
    hand::FingerAngles q_rad;
  };
  [[nodiscard]] Posture posture(double t_s) const;

  hand::HandModel model_;
  Pose X_WM_middle_;
  hand::FingerAngles q_open_rad_, q_closed_rad_;
  std::array<Eigen::Vector3d, 3> p_M_back_;  // top, left, right marker
};

/// The same as a motion without end at 100 Hz, with the markers' names.
[[nodiscard]] sim::Motion operator_markers();

}  // namespace embody::faults
