#pragma once
// What the simulated dashboard server answers, line by line. Pure but for the robot that it acts on. Source: Universal
// Robots, "Dashboard server e-Series"; which text a refused command gets in local control is an estimate.
#include <string>
#include <string_view>

#include "drivers/sim/ur/ur_robot.hpp"

namespace embody::sim {

struct DashboardInfo {
  std::string version{"5.12.4.1101661"};
  std::string model{"UR10"};  ///< without the "e", as the real one says
  std::string serial{"20225600000"};
};

struct DashboardAnswer {
  std::string text;  ///< without line end
  bool quit{false};
};

/// `line` without its end; upper and lower case alike.
[[nodiscard]] DashboardAnswer answer_dashboard(std::string_view line, UrRobot& robot, const DashboardInfo& info);

}  // namespace embody::sim
