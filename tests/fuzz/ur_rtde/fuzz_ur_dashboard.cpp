// Any text as replies of a dashboard server, as commands to the simulated one, as programs on a script port, and as
// names of faults.
#include <cstdlib>

#include "drivers/sim/ur/controller_faults.hpp"
#include "drivers/sim/ur/dashboard_commands.hpp"
#include "drivers/sim/ur/script_port.hpp"
#include "drivers/ur_rtde/dashboard_reply.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace embody;
  static sim::UrRobot robot([] {
    sim::UrRobotConfig config;
    config.program_text = "";
    return config;
  }());
  const std::string text(reinterpret_cast<const char*>(data), size);
  std::string pending = text, line;
  while (ur::take_line(pending, line)) {
    if (line.find('\n') != std::string::npos) std::abort();
    (void)ur::parse_robot_mode(line);
    (void)ur::parse_safety_status(line);
    (void)ur::parse_flag(line);
    (void)ur::parse_polyscope_version(line);
    (void)ur::check_acknowledged(line, line, "Powering on");
    if (sim::answer_dashboard(line, robot, {}).text.find('\n') != std::string::npos) std::abort();
    (void)sim::parse_ur_fault(line);
  }
  pending = text;
  std::size_t taken = 0;
  while (const auto program = sim::take_program(pending)) taken += program->size();
  if (taken + pending.size() > size) std::abort();
  return 0;
}
