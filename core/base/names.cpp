#include "core/base/names.hpp"

#include <algorithm>
#include <numeric>

namespace embody {
namespace {

constexpr std::size_t kLongestCompared = 128;

char fold(char c) noexcept {
  if (c >= 'A' && c <= 'Z') return static_cast<char>(c - 'A' + 'a');
  return c == ' ' || c == '-' || c == '.' ? '_' : c;
}

std::string folded(std::string_view text) {
  std::string result(text.substr(0, kLongestCompared));
  std::transform(result.begin(), result.end(), result.begin(), fold);
  return result;
}

std::vector<std::string_view> missing_names(const std::vector<std::string>& wanted,
                                            const std::vector<std::string>& available) {
  std::vector<std::string_view> missing;
  for (const auto& name : wanted) {
    if (std::find(available.begin(), available.end(), name) == available.end()) missing.push_back(name);
  }
  return missing;
}

}  // namespace

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, diagonal + 1, row[j] + 1});
    }
  }
  return row.back();
}

std::string_view nearest_name(std::string_view name, const std::vector<std::string>& available) {
  std::string_view best;
  std::size_t best_distance = name.size() / 3 + 1;
  const std::string wanted = folded(name);
  for (const auto& candidate : available) {
    const auto found = edit_distance(wanted, folded(candidate));
    if (found < best_distance) {
      best_distance = found;
      best = candidate;
    }
  }
  return best;
}

std::string describe_missing(const std::vector<std::string>& wanted, const std::vector<std::string>& available,
                             std::size_t max_size) {
  const auto missing = missing_names(wanted, available);
  std::size_t size_of_names = 0;
  for (const auto name : missing) size_of_names += name.size() + 4;
  std::string text;
  for (std::size_t i = 0; i < missing.size(); ++i) {
    const std::string quoted = (i > 0 ? ", '" : "'") + std::string(missing[i]) + "'";
    if (text.size() + quoted.size() > max_size) {
      return text + " and " + std::to_string(missing.size() - i) + " more";
    }
    text += quoted;
    size_of_names -= missing[i].size() + 4;
    const auto similar = nearest_name(missing[i], available);
    const std::string hint = similar.empty() ? "" : " (similar: '" + std::string(similar) + "')";
    if (text.size() + hint.size() + size_of_names <= max_size) text += hint;
  }
  return text;
}

}  // namespace embody
