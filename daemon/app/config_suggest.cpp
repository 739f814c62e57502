#include "daemon/app/config_suggest.hpp"

#include <algorithm>

#include "daemon/app/config_io.hpp"

namespace embody::config {
namespace {

/// Edits (insert, delete, replace) between two words.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

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
      if (other.key == name) return "; it belongs " + table_text(other.table);
    }
  }
  return nearest.empty() ? std::string() : "; did you mean '" + std::string(nearest) + "'?";
}

}  // namespace embody::config
