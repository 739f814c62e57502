#pragma once
// The status of the daemon as a table for people.
#include <string>

namespace embody::ctl {

/// Turns the JSON text of a status (docs/control.md) into lines. Members that are missing are left out; members that
/// this version does not know are listed at the end, so that a newer daemon loses nothing. Never throws for bad text.
[[nodiscard]] std::string status_table(const std::string& json_text);

/// The same for what a robot hand measures (member `hand` of the status, or the result of `embodyctl hand show`).
[[nodiscard]] std::string hand_table(const std::string& json_text);

/// `text` without control characters, which could write over the terminal.
[[nodiscard]] std::string printable(std::string text);

}  // namespace embody::ctl
