#pragma once
// The faults of the simulated gripper as text: pure functions.
#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/result.hpp"

namespace embody::sim {

struct RobotiqFault {
  enum class Kind : std::uint8_t {
    kDrop,
    kGarble,
    kCrc,
    kException,
    kMute,
    kUnplug,
    kPlug,
    kFault,
    kDeactivate,
    kObject,
    kDelay,
  };
  Kind kind{Kind::kDrop};
  int number{0};  ///< count, code, width (mm; negative: no object) or delay (ms)
  bool on{true};
};

/// One fault, e.g. `drop 3`, `mute on`, `object 60`; robotiq_fault_help() lists all.
/// Error kInvalidArgument: unknown fault, a missing, surplus or impossible argument.
[[nodiscard]] Result<RobotiqFault> parse_robotiq_fault(std::string_view words);

/// One line per fault: its words, then what it does.
[[nodiscard]] std::string robotiq_fault_help();

}  // namespace embody::sim
