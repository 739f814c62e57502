#pragma once
// A simulated sensor of some kind, the line to it, and what the contract of trackers needs to know about it.
#include <memory>

#include "core/hal/hand_tracker.hpp"
#include "tests/contract/laws.hpp"

namespace embody::test {

class TrackerCell : public Cell {
 public:
  [[nodiscard]] virtual std::unique_ptr<HandTracker> driver() = 0;
  /// The sensor no longer sees the marker of slot kHiddenSlot, or sees it again.
  virtual void hide(bool on) = 0;
  /// Everything that the driver has said to the sensor.
  [[nodiscard]] virtual std::string heard() { return {}; }

  static constexpr std::size_t kHiddenSlot = 4;
  std::size_t marker_count{0};
  double rate_hz{0.0};
  bool has_body{false};
};

std::unique_ptr<TrackerCell> qtm_little_endian();
std::unique_ptr<TrackerCell> qtm_big_endian();
std::unique_ptr<TrackerCell> qtm_udp();
std::unique_ptr<TrackerCell> qtm_rigid_body();
std::unique_ptr<TrackerCell> landmarks_udp();

}  // namespace embody::test
