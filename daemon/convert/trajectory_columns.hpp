#pragma once
// What the text formats of a trajectory have in common: names of columns, numbers, and what they mean.
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/convert/trajectory.hpp"

namespace embody::convert {

inline constexpr int kFormatVersion = 1;

/// time_s, x_m, y_m, z_m, qw, qx, qy, qz, one column per joint (its name and _rad or _m), valid (1 or 0).
[[nodiscard]] std::vector<std::string> column_names(const Trajectory& trajectory);

/// One row of numbers in the order of the columns.
void row_values(const Trajectory& trajectory, std::size_t row, std::vector<double>& values);

/// The inverses: joints from column names (kMalformed: not these columns), and a row appended.
/// @pre values.size() is that of the columns
[[nodiscard]] Status set_columns(const std::vector<std::string>& names, Trajectory& trajectory);
void append_row(const std::vector<double>& values, Trajectory& trajectory);

/// Key and text: what a file is about, for people and programs. `set_about` reads those that a trajectory keeps, and
/// leaves others alone; false: the text is no value of that key.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> about(const Trajectory& trajectory);
[[nodiscard]] bool set_about(std::string_view key, std::string_view text, Trajectory& trajectory);

/// Appends the number with nine significant digits, independent of any locale; not finite: `missing`.
void append_number(double value, std::string_view missing, std::string& text);

/// The whole text as a number.
[[nodiscard]] bool parse_number(std::string_view text, double& value) noexcept;

}  // namespace embody::convert
