#pragma once
// The simulated devices of a fault matrix cell behind one interface each: what they did, and their faults by name.
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/base/time.hpp"

namespace embody::faults {

enum class HandKind { kMia, kStreamingMia, kCanMia, kRobotiq };
enum class TrackerKind { kTcp, kUdp, kRigidBody, kLandmarks };

class SimulatedHand {
 public:
  SimulatedHand() = default;
  SimulatedHand(const SimulatedHand&) = delete;
  SimulatedHand& operator=(const SimulatedHand&) = delete;
  virtual ~SimulatedHand() = default;
  virtual Status start() = 0;
  virtual Status fault(std::string_view words) = 0;
  /// Angles of its motors now, rad: where they really are.
  [[nodiscard]] virtual std::vector<double> angles_rad() const = 0;
  /// Motion commands that it obeyed so far.
  [[nodiscard]] virtual std::uint64_t motions() const = 0;
};

/// `link`: where the driver finds the device: a path of a symlink to a pseudo-terminal, or of a CAN double.
[[nodiscard]] std::unique_ptr<SimulatedHand> make_hand(HandKind kind, const std::string& link);

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
