#pragma once
// Marker frames in, hand poses out: one step per frame, in order.
#include "core/hand/hand_pose_estimator.hpp"
#include "core/teleop/pose_monitor.hpp"
#include "daemon/loops/edges.hpp"

namespace embody {

class TrackerLoop {
 public:
  TrackerLoop(TrackerBaton& baton, const hand::HandPoseEstimator& estimator, Edges& edges) noexcept
      : baton_(baton), estimator_(estimator), edges_(edges) {}
  /// Until edges.stop. No heap, lock, log or exception.
  void run() noexcept;

 private:
  void drain() noexcept;
  void use() noexcept;

  TrackerBaton& baton_;
  hand::HandPoseEstimator estimator_;
  teleop::PoseMonitor monitor_;
  Edges& edges_;
  TrackedFrame tracked_;
  std::uint64_t sequence_{0};
};

}  // namespace embody
