#pragma once
// Names that people type: the most similar one, and which are missing.
#include <string>
#include <string_view>
#include <vector>

namespace embody {

/// Levenshtein distance (insert, delete, replace) of two texts. Cost: product of their lengths.
[[nodiscard]] std::size_t edit_distance(std::string_view a, std::string_view b);

/// The name among `available` that differs least from `name` (edit distance, ignoring case and treating space, `-`,
/// `.` and `_` alike), or empty when nothing is similar: more than a third of the letters would have to change.
[[nodiscard]] std::string_view nearest_name(std::string_view name, const std::vector<std::string>& available);

/// Names of `wanted` that are not in `available`, as text: `'a' (similar: 'b'), 'c'`. Empty when none is missing.
/// Suggestions, then names at the end, are left out where the text would exceed `max_size`.
[[nodiscard]] std::string describe_missing(const std::vector<std::string>& wanted,
                                           const std::vector<std::string>& available, std::size_t max_size);

}  // namespace embody
