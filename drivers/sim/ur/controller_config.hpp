#pragma once
// How the simulated controller is set up.
#include <set>
#include <string>

#include "drivers/sim/ur/ur_robot.hpp"
#include "drivers/ur_rtde/arm_package.hpp"
#include "drivers/ur_rtde/codec.hpp"

namespace embody::sim {

struct UrControllerConfig {
  std::string address{"127.0.0.1"};
  std::uint16_t port{0};            ///< RTDE; 0 takes a free one, like all ports here
  std::uint16_t primary_port{0};    ///< in place of 30001
  std::uint16_t secondary_port{0};  ///< in place of 30002
  std::uint16_t realtime_port{0};   ///< in place of 30003
  std::uint16_t dashboard_port{0};  ///< in place of 29999; not opened by a version 10 and above
  double frequency_hz{500.0};       ///< control cycles per second, 1 to 1000; a CB3 has 125
  rtde::ControllerVersion version{5, 12, 4, 1'101'661};
  std::string model{"UR10e"};                  ///< geometry that is reported and used for the tool's pose
  std::set<std::string, std::less<>> missing;  ///< RTDE variables that this firmware does not have
  rtde::ArmSettings settings;                  ///< payload and tool centre point of the installation
  UrRobotConfig robot;                         ///< q_start_rad, limits, lag, program
  SafetyTimes times;                           ///< of power, brakes and releases
  bool powered{true};                          ///< false: starts with the power off
  bool remote{true};                           ///< false: local control
  std::size_t log_capacity{30'000};            ///< newest samples kept, one per control cycle
  std::size_t max_clients{8};                  ///< of RTDE
};

}  // namespace embody::sim
