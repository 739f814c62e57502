#pragma once
// Our control program for the robot, as URScript text: it reads the arm driver's registers in each control cycle and
// moves the arm by servoj. Not run on a real robot yet; the simulated controller runs this very text.
#include <string>

#include "core/base/result.hpp"
#include "core/hal/types.hpp"

namespace embody::rtde {

/// Limits that the robot's side keeps, whatever is in its registers.
struct ControlScriptConfig {
  Vector6 max_velocity_rad_s{1.0, 1.0, 1.5, 2.0, 2.0, 2.0};          ///< up to 6.3
  Vector6 max_acceleration_rad_s2{4.0, 4.0, 6.0, 10.0, 10.0, 10.0};  ///< up to 40
  Vector6 min_angle_rad = Vector6::Constant(-6.2);  ///< targets below are refused, and the joints stay above
  Vector6 max_angle_rad = Vector6::Constant(6.2);
  double approach_gain_1_s{30.0};                       ///< final approach, velocity per distance, up to 60
  double arm_tolerance_rad{0.10};                       ///< largest distance of the first target, per joint, up to 0.5
  Duration stale_after{std::chrono::milliseconds(50)};  ///< 20 to 200 ms without a new sequence end tracking
  double lookahead_s{0.05};                             ///< of servoj, 0.03 to 0.2
  double gain{600.0};                                   ///< of servoj, 100 to 2000
  double stop_deceleration_rad_s2{4.0};                 ///< of stopj at the beginning and the end, up to 40
  double watchdog_hz{10.0};  ///< fewer input packages end the program; its period is longer than stale_after
};

inline constexpr const char* kControlScriptName = "embody_control";

/// The program's text, about 7 kB, ending in a line end. Runs at 125 Hz (CB3) and 500 Hz. kInvalidArgument names the
/// limit that is not possible.
[[nodiscard]] Result<std::string> control_script(const ControlScriptConfig& config);

}  // namespace embody::rtde
