#pragma once
// Formatting that the reports share.
#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace embody::evaluate {

/// Appends formatted text, cut at 255 characters.
__attribute__((format(printf, 2, 3))) inline void print(std::string& text, const char* format, ...) {
  char line[256];
  va_list args;
  va_start(args, format);
  std::vsnprintf(line, sizeof line, format, args);
  va_end(args);
  text += line;
}

/// The value in a printf format for one double; "-" for none.
[[nodiscard]] inline std::string number(std::optional<double> value, const char* format) {
  if (!value) return "-";
  char text[32];
  std::snprintf(text, sizeof text, format, *value);
  return text;
}

[[nodiscard]] inline nlohmann::ordered_json json_number(std::optional<double> value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
}

}  // namespace embody::evaluate
