#include "daemon/app/config_suggest.hpp"

#include <algorithm>

#include "core/base/names.hpp"
#include "daemon/app/config_io.hpp"

namespace embody::config {
std::string table_text(const std::string& table) {
  return table.empty() ? "at the top of the file" : "in [" + table + "]";
}

std::string suggestion(std::string_view name, const std::vector<std::string>& known) {
  const std::string_view word = name.substr(0, 64);
  std::string_view nearest;
  std::size_t best = std::max<std::size_t>(2, word.size() * 2 / 5) + 1;
  for (const std::string& candidate : known) {
    const std::size_t distance = edit_distance(word, candidate);
    if (distance < best) {
      best = distance;
      nearest = candidate;
    }
  }
  if (best > 2) {
    for (const KeyName& other : all_keys()) {
      if (other.key == name && !other.table.empty()) return "; it belongs " + table_text(other.table);
    }
  }
  return nearest.empty() ? std::string() : "; did you mean '" + std::string(nearest) + "'?";
}

}  // namespace embody::config
