#pragma once
// What somebody may have meant who wrote an unknown key.
#include <string>
#include <string_view>
#include <vector>

namespace embody::config {

/// "in [arm.limits]", or "at the top of the file" for the empty name.
[[nodiscard]] std::string table_text(const std::string& table);

/// "; did you mean 'x'?" with the nearest of `known` (by edits), "; it belongs in [table]" when another table has that
/// very key, or "" when nothing is near.
[[nodiscard]] std::string suggestion(std::string_view name, const std::vector<std::string>& known);

}  // namespace embody::config
