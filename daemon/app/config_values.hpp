#pragma once
// From a TOML node to one value of the configuration, checked. Internal to parsing.
#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/app/config_field.hpp"

namespace toml {
inline namespace v3 {
class node;  // toml++ stays in the .cpp files
}
}  // namespace toml

namespace embody::config {

inline constexpr std::size_t kMaxItems = 64;  ///< of a list

/// "must be WHAT, not ...": what the node is instead.
[[nodiscard]] std::string wanted(const char* what, const toml::node& node);

// Each returns why the node is not acceptable, or "" after it has set the value.
std::string read_value(const toml::node& node, double& value, Range range, std::string_view unit);
std::string read_value(const toml::node& node, int& value, Range range, std::string_view unit);
std::string read_value(const toml::node& node, bool& value, Range range, std::string_view unit);
std::string read_value(const toml::node& node, std::string& value, Range range, std::string_view unit);

/// Entries of a list; nothing when the node is none.
[[nodiscard]] std::optional<std::size_t> list_size(const toml::node& node);
/// @pre i < list_size(list)
[[nodiscard]] const toml::node& list_entry(const toml::node& list, std::size_t i);

template <class Rep, class Period>
std::string read_value(const toml::node& node, std::chrono::duration<Rep, Period>& value, Range range,
                       std::string_view unit) {
  int count = 0;
  auto why = read_value(node, count, range, unit);
  if (why.empty()) value = std::chrono::duration<Rep, Period>(count);
  return why;
}

/// A list of any length, or exactly as many numbers as a fixed array has.
template <class T>
requires requires(T& sequence) {
  sequence.begin();
}
std::string read_value(const toml::node& node, T& value, Range range, std::string_view unit) {
  const auto size = list_size(node);
  if (!size) return wanted("a list", node);
  T items = value;
  if constexpr (requires { items.clear(); }) {
    if (*size > kMaxItems) return "has more than " + std::to_string(kMaxItems) + " entries";
    items.resize(*size);
  } else if (*size != static_cast<std::size_t>(items.size())) {
    return "needs " + std::to_string(items.size()) + " numbers, has " + std::to_string(*size);
  }
  std::size_t i = 0;
  for (auto& item : items) {
    const auto why = read_value(list_entry(node, i), item, range, unit);
    if (!why.empty()) return "entry " + std::to_string(i + 1) + " " + why;
    ++i;
  }
  value = items;
  return {};
}

}  // namespace embody::config
