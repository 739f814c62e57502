#pragma once
// Faults of the simulated controller by name, for people and fault scripts.
#include <functional>
#include <string>
#include <string_view>

#include "core/base/result.hpp"

namespace embody::sim {

class ControllerLoop;

/// What a fault does, to be run between two control cycles.
using FaultAction = std::function<void(ControllerLoop&)>;

/// "freeze 0.5", "in-use 3", "protective-stop", ...: the list is kFaultHelp. "ur " may stand in front, and _ for -.
/// Errors: kInvalidArgument, with what is wrong and, for an unknown name, the list.
[[nodiscard]] Result<FaultAction> parse_ur_fault(std::string_view line);

/// One line per fault: its words, blanks up to column 32, what it does.
[[nodiscard]] std::string ur_fault_help();

inline constexpr const char* kFaultHelp =
    "disconnect, reset, restart, freeze on|off|SECONDS, deaf on|off, clock on|off, jitter MS, fragment on|off, "
    "coalesce N, texts on|off, in-use SECONDS, occupy on|off, remote, local, refuse-upload on|off, program on|off, "
    "echo on|off, protective-stop, safeguard on|off, emergency-stop, release-emergency-stop, violation, fault, "
    "clear-stop, power-off, payload KG, speed FRACTION";

}  // namespace embody::sim
