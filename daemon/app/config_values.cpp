#include "daemon/app/config_values.hpp"

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace embody::config {
namespace {

constexpr std::size_t kMaxText = 256;

const char* type_name(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "a list";
    case toml::node_type::string:
      return "text";
    case toml::node_type::integer:
      return "a whole number";
    case toml::node_type::floating_point:
      return "a number with a fraction";
    case toml::node_type::boolean:
      return "true/false";
    default:
      return "a date or time";
  }
}

std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

std::string check_range(double value, Range range, std::string_view unit) {
  if (value >= range.min && value <= range.max) return {};
  return "is " + number_text(value) + ", out of range: " + number_text(range.min) + " to " + number_text(range.max) +
         (unit.empty() ? "" : " ") + std::string(unit);
}

}  // namespace

std::string wanted(const char* what, const toml::node& node) {
  return std::string("must be ") + what + ", not " + type_name(node);
}

std::string read_value(const toml::node& node, double& value, Range range, std::string_view unit) {
  if (!node.is_number()) return wanted("a number", node);
  const double number = node.is_integer() ? static_cast<double>(**node.as_integer()) : **node.as_floating_point();
  if (!std::isfinite(number)) return "must be finite, not nan or inf";
  auto why = check_range(number, range, unit);
  if (why.empty()) value = number;
  return why;
}

std::string read_value(const toml::node& node, int& value, Range range, std::string_view unit) {
  const auto* integer = node.as_integer();
  if (integer == nullptr) return wanted("a whole number", node);
  auto why = check_range(static_cast<double>(**integer), range, unit);
  if (why.empty()) value = static_cast<int>(**integer);
  return why;
}

std::string read_value(const toml::node& node, bool& value, Range, std::string_view) {
  if (!node.is_boolean()) return wanted("true or false", node);
  value = **node.as_boolean();
  return {};
}

std::string read_value(const toml::node& node, std::string& value, Range, std::string_view) {
  const auto* text = node.as_string();
  if (text == nullptr) return wanted("text", node);
  const std::string& content = **text;
  if (content.size() > kMaxText) return "is longer than " + std::to_string(kMaxText) + " bytes";
  if (std::any_of(content.begin(), content.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; })) {
    return "contains a control character";
  }
  value = content;
  return {};
}

std::optional<std::size_t> list_size(const toml::node& node) {
  const auto* array = node.as_array();
  if (array == nullptr) return std::nullopt;
  return array->size();
}

const toml::node& list_entry(const toml::node& list, std::size_t i) {
  return (*list.as_array())[i];
}

}  // namespace embody::config
