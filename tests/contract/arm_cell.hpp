#pragma once
// A simulated robot arm of some kind, the lines to it, and what the contract of arm drivers needs to know about it.
#include <memory>

#include "core/hal/arm_driver.hpp"
#include "tests/contract/laws.hpp"

namespace embody::test {

/// What the arm does and has heard, by its own record.
struct ArmRecord {
  Vector6 q_rad{Vector6::Zero()};
  Vector6 qd_rad_s{Vector6::Zero()};
  std::uint64_t commands{0};  ///< that arrived, whatever they asked for
  std::uint64_t motions{0};   ///< of these: those that ask for motion
};

class ArmCell : public Cell {
 public:
  [[nodiscard]] virtual std::unique_ptr<ArmDriver> driver(Pace pace) = 0;
  [[nodiscard]] virtual ArmRecord record() = 0;

  double rate_hz{0.0};
  double top_speed_rad_s{0.0};  ///< of joint 0, that the robot's side keeps whatever it is told
  Duration stop_bound{0};       ///< from the driver's end at kContractSpeed_rad_s until the arm stands still
};

inline constexpr double kContractSpeed_rad_s = 0.5;  ///< of joint 0 in these tests

std::unique_ptr<ArmCell> ur_e_series();
std::unique_ptr<ArmCell> ur_cb3();

}  // namespace embody::test
