#pragma once
// A Robotiq gripper that exists only as a pseudo-terminal: speaks the real bytes, moves at the real speeds.
#include <memory>
#include <string>

#include "drivers/sim/robotiq/gripper.hpp"

namespace embody::sim {

struct RobotiqSimulatorConfig {
  std::string link;  ///< path of a symlink to the device; empty: none
  RobotiqGripperConfig gripper;
};

/// One thread between start() and stop(). Every function may be called from any thread, but start(), stop() and the
/// faults unplug and plug only from one.
class RobotiqSimulator {
 public:
  explicit RobotiqSimulator(const RobotiqSimulatorConfig& config);
  ~RobotiqSimulator();  ///< stop()
  RobotiqSimulator(const RobotiqSimulator&) = delete;
  RobotiqSimulator& operator=(const RobotiqSimulator&) = delete;

  /// Creates the pseudo-terminal and the symlink; the gripper is as it was before.
  /// Errors: kRefused (something other than a symlink is at `link`), kIo.
  Status start();
  /// Ends the thread, closes the device and removes the symlink if it is still ours.
  void stop() noexcept;
  /// Path of the device ("/dev/pts/N"); empty while there is none.
  [[nodiscard]] std::string device() const;

  /// Errors: as start(), for `plug`.
  Status apply(const RobotiqFault& fault);
  /// Words of parse_robotiq_fault(). Errors: as that, and as start().
  Status fault(std::string_view words);

  [[nodiscard]] double counts() const;
  [[nodiscard]] double travelled_counts() const;
  [[nodiscard]] robotiq::GripperStatus status() const;
  [[nodiscard]] RobotiqGripperCounters counters() const;

 private:
  class Line;
  std::unique_ptr<Line> line_;
};

}  // namespace embody::sim
