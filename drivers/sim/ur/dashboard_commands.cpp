#include "drivers/sim/ur/dashboard_commands.hpp"

#include <algorithm>
#include <array>
#include <optional>

namespace embody::sim {
namespace {

using Answer = std::optional<std::string>;

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return lower;
}

std::string yes_no(bool yes) {
  return yes ? "true" : "false";
}

const char* mode_name(int mode) noexcept {
  constexpr std::array<const char*, 9> kNames{"DISCONNECTED", "CONFIRM_SAFETY", "BOOTING",
                                              "POWER_OFF",    "POWER_ON",       "IDLE",
                                              "BACKDRIVE",    "RUNNING",        "UPDATING_FIRMWARE"};
  return mode >= 0 && mode < static_cast<int>(kNames.size()) ? kNames[static_cast<std::size_t>(mode)] : "NO_CONTROLLER";
}

const char* safety_name(int status) noexcept {
  constexpr std::array<const char*, 10> kNames{"",
                                               "NORMAL",
                                               "REDUCED",
                                               "PROTECTIVE_STOP",
                                               "RECOVERY",
                                               "SAFEGUARD_STOP",
                                               "SYSTEM_EMERGENCY_STOP",
                                               "ROBOT_EMERGENCY_STOP",
                                               "VIOLATION",
                                               "FAULT"};
  return status >= 1 && status < static_cast<int>(kNames.size()) ? kNames[static_cast<std::size_t>(status)]
                                                                 : "UNDEFINED_SAFETY_MODE";
}

/// Questions and what touches no joint: answered in local control, too.
Answer answer_question(const std::string& command, UrRobot& robot, const DashboardInfo& info) {
  const SafetyStatus& safety = robot.safety();
  SafetyMachine& machine = robot.machine();
  if (command == "robotmode") return std::string("Robotmode: ") + mode_name(safety.robot_mode);
  if (command == "safetystatus") return std::string("Safetystatus: ") + safety_name(safety.safety_status);
  if (command == "safetymode") return std::string("Safetymode: ") + safety_name(safety.safety_status);
  if (command == "polyscopeversion") return "URSoftware " + info.version + " (Sep 21 2022)";
  if (command == "version") return info.version;
  if (command == "get serial number") return info.serial;
  if (command == "get robot model") return info.model;
  if (command == "is in remote control") return yes_no(machine.remote());
  if (command == "running") return "Program running: " + yes_no(machine.playing());
  // A program that came over a socket has no file, and does not count here.
  if (command == "programstate") return "STOPPED <unnamed>";
  if (command == "get loaded program") return "No program loaded";
  if (command == "isprogramsaved") return "true <unnamed>";
  if (command.starts_with("addtolog ")) return "Added log message";
  if (command.starts_with("popup ")) {
    machine.show_popup(command.substr(6));
    return "showing popup";
  }
  if (command == "close popup" || command == "close safety popup") {
    machine.show_popup("");
    return command == "close popup" ? "closing popup" : "closing safety popup";
  }
  return std::nullopt;
}

/// What acts on the arm; empty for an unknown command, "Failed to execute: ..." when the mode does not allow it.
Answer answer_request(const std::string& command, UrRobot& robot) {
  SafetyMachine& machine = robot.machine();
  const auto done = [&](bool ok, const char* text) { return ok ? text : "Failed to execute: " + command; };
  const bool allowed = machine.remote();
  if (command == "power on") return done(allowed && machine.power_on(), "Powering on");
  if (command == "power off") return done(allowed && machine.power_off(), "Powering off");
  if (command == "brake release") return done(allowed && machine.release_brakes(), "Brake releasing");
  if (command == "restart safety") return done(allowed && machine.restart_safety(), "Restarting safety");
  if (command == "pause") return done(allowed && machine.pause_program(), "Pausing program");
  if (command == "unlock protective stop") {
    if (!allowed) return done(false, "");
    if (machine.status().safety_status != 3 || machine.unlock_protective_stop()) return "Protective stop releasing";
    return "Cannot unlock protective stop until 5s after occurrence. Always inspect cause of protective stop before "
           "unlocking";
  }
  if (command == "play") {
    const bool can = allowed && robot.has_program() && machine.may_move();
    if (can) robot.set_program_running(true);
    return done(can, "Starting program");
  }
  if (command == "stop") {
    if (allowed) robot.set_program_running(false);
    return done(allowed, "Stopped");
  }
  if (command.starts_with("load ")) return "File not found: " + command.substr(5);
  return std::nullopt;
}

}  // namespace

DashboardAnswer answer_dashboard(std::string_view line, UrRobot& robot, const DashboardInfo& info) {
  while (!line.empty() && (line.back() == ' ' || line.back() == '\r')) line.remove_suffix(1);
  const std::string command = lower_case(line);
  if (command == "quit") return {"Disconnected", true};
  if (const Answer answer = answer_question(command, robot, info)) return {*answer, false};
  if (const Answer answer = answer_request(command, robot)) return {*answer, false};
  return {"could not understand: '" + std::string(line.substr(0, 200)) + "'", false};
}

}  // namespace embody::sim
