#pragma once
// Replies of the dashboard server as pure functions over text. Source: Universal Robots, "Dashboard server e-Series".
#include <string>

#include "core/base/result.hpp"

namespace embody::ur {

/// Takes one line (without line end) off the front of `pending`; false while no whole line has arrived.
[[nodiscard]] bool take_line(std::string& pending, std::string& line);

/// "Robotmode: POWER_OFF" to the RTDE code (3). Errors: kMalformed.
[[nodiscard]] Result<int> parse_robot_mode(std::string_view reply) noexcept;
/// "Safetystatus: NORMAL" or "Safetymode: NORMAL" to the RTDE code (1). Errors: kMalformed.
[[nodiscard]] Result<int> parse_safety_status(std::string_view reply) noexcept;
/// "true" or "false", also "Program running: true". Errors: kMalformed.
[[nodiscard]] Result<bool> parse_flag(std::string_view reply) noexcept;
/// "URSoftware 5.12.4.1101661 (Sep 21 2022)" to "5.12.4.1101661". Errors: kMalformed.
[[nodiscard]] Result<std::string> parse_polyscope_version(std::string_view reply);

/// Success when `reply` starts with `expected` (upper and lower case alike). Errors, as a sentence for the operator:
/// kRefused ("Failed to execute", not in remote control, the 5 s after a protective stop), kUnsupported (a firmware
/// that does not know the command), kMalformed.
[[nodiscard]] Status check_acknowledged(std::string_view command, std::string_view reply,
                                        std::string_view expected) noexcept;

}  // namespace embody::ur
