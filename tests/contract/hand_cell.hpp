#pragma once
// A simulated hand of some kind, the line to it, and what the contract of hand drivers needs to know about it.
#include <memory>
#include <vector>

#include "core/hal/hand_driver.hpp"
#include "tests/contract/laws.hpp"

namespace embody::test {

class HandCell : public Cell {
 public:
  [[nodiscard]] virtual std::unique_ptr<HandDriver> driver(Pace pace) = 0;

  // The device's own record, by a way of its own and not by the driver's line.
  /// Where its motors are, in its own unit.
  [[nodiscard]] virtual std::vector<double> motors() = 0;
  /// Commands that move something, as far as they were heard.
  [[nodiscard]] virtual std::uint64_t motions() = 0;

  std::vector<double> near_rad, far_rad;      ///< two poses; from the near one it takes the far one at least a second
  std::vector<double> near_units, far_units;  ///< the same as motors() tells them
  std::vector<double> most_units;             ///< where a target far beyond the limits ends
  double tolerance{1.5};                      ///< of motors()
  std::string unclamped;                      ///< why targets far out of range are passed on; empty: they are clamped
  std::string drops_newest;  ///< why the oldest of two commands in one cycle counts; empty: the newest does
};

std::unique_ptr<HandCell> mia_serial_acknowledging();
std::unique_ptr<HandCell> mia_serial_streaming();
std::unique_ptr<HandCell> mia_can_isotp();
std::unique_ptr<HandCell> mia_can_segments();
std::unique_ptr<HandCell> mia_can_compact();
std::unique_ptr<HandCell> robotiq();
std::unique_ptr<HandCell> joint_state();

}  // namespace embody::test
