#pragma once
// Trajectories as comma- or tab-separated text: lines `# key: text` (what it is), a line of column names, rows.
#include <string>
#include <string_view>

#include "daemon/convert/trajectory.hpp"

namespace embody::convert {

/// `separator` is ',' or '\t'. Unknown numbers are `nan`.
[[nodiscard]] std::string format_csv(const Trajectory& trajectory, char separator);

/// Reads what format_csv() wrote, with either separator, LF or CRLF. Errors, with source, line and column: kMalformed.
[[nodiscard]] Result<Trajectory> parse_csv(std::string_view text, std::string_view source);

}  // namespace embody::convert
