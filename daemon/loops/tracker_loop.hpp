#pragma once
// Marker frames in, hand poses out: one step per frame, in order.
#include "core/hand/palm_pose_estimator.hpp"
#include "core/teleop/pose_monitor.hpp"
#include "core/teleop/pose_predictor.hpp"
#include "daemon/loops/edges.hpp"

namespace embody {

class TrackerLoop {
 public:
  TrackerLoop(TrackerBaton& baton, const hand::PoseEstimator& estimator, const teleop::PoseMonitor& monitor,
              const teleop::PosePredictor& predictor, Edges& edges) noexcept
      : baton_(baton), estimator_(estimator), monitor_(monitor), predictor_(predictor), edges_(edges) {}
  /// Until edges.stop. No heap, lock, log or exception.
  void run() noexcept;

 private:
  void drain() noexcept;
  void use() noexcept;

  TrackerBaton& baton_;
  hand::PoseEstimator estimator_;
  teleop::PoseMonitor monitor_;
  std::optional<std::uint32_t> label_epoch_;  ///< of the last frame
  teleop::PosePredictor predictor_;
  Edges& edges_;
  TrackedFrame tracked_;  // as measured: fingers and observers
  HandPose ahead_;        // predicted: the arm
  std::uint64_t sequence_{0};
};

}  // namespace embody
