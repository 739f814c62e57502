#pragma once
// Trajectories as JSON: {"about": {key: text}, "columns": [name, ...], "rows": [[number, ...], ...]}.
#include <string>
#include <string_view>

#include "daemon/convert/trajectory.hpp"

namespace embody::convert {

/// Keys, columns and numbers are those of the CSV; unknown numbers are null. One line per row.
[[nodiscard]] std::string format_json(const Trajectory& trajectory);

/// Reads what format_json() wrote. Errors, with source, row and column: kMalformed.
[[nodiscard]] Result<Trajectory> parse_json(std::string_view text, std::string_view source);

}  // namespace embody::convert
