#pragma once
// The simulated trackers of the fault matrix behind one interface. Arm and hands are those of the simulated lab.
#include <memory>
#include <string>
#include <string_view>

#include "core/base/result.hpp"

namespace embody::faults {

enum class HandKind { kMia, kStreamingMia, kCanMia, kRobotiq };
enum class TrackerKind { kTcp, kUdp, kRigidBody, kLandmarks };

/// What the simulated tracker of a cell needs.
class SimulatedTracker {
 public:
  SimulatedTracker() = default;
  SimulatedTracker(const SimulatedTracker&) = delete;
  SimulatedTracker& operator=(const SimulatedTracker&) = delete;
  virtual ~SimulatedTracker() = default;
  virtual Status start() = 0;
  virtual Status fault(std::string_view words) = 0;
  /// Lines of the table [tracker] that lead the daemon here.
  [[nodiscard]] virtual std::string config() const = 0;
};
[[nodiscard]] std::unique_ptr<SimulatedTracker> make_tracker(TrackerKind kind);

}  // namespace embody::faults
