#include "daemon/convert/trajectory_json.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/convert/trajectory_columns.hpp"

namespace embody::convert {
namespace {

using nlohmann::json;

/// A JSON string; bytes that are no UTF-8 are replaced.
std::string text_literal(const std::string& text) {
  return json(text).dump(-1, ' ', false, json::error_handler_t::replace);
}

Error malformed(std::string_view source, const std::string& what) {
  return make_error(Errc::kMalformed, "%.80s: %s", std::string(source).c_str(), what.c_str());
}

/// Numbers of one row, or why it has none.
std::string read_row(const json& row, const std::vector<std::string>& names, std::vector<double>& values) {
  if (!row.is_array() || row.size() != names.size()) return "needs " + std::to_string(names.size()) + " numbers";
  values.clear();
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!row[i].is_number() && !row[i].is_null()) return "column '" + names[i] + "' is no number";
    values.push_back(row[i].is_null() ? std::nan("") : row[i].get<double>());
  }
  return {};
}

}  // namespace

std::string format_json(const Trajectory& trajectory) {
  std::string text = "{\n  \"about\": {";
  const char* separator = "\n    ";
  for (const auto& [key, value] : about(trajectory)) {
    text += separator + text_literal(key) + ": " + text_literal(value);
    separator = ",\n    ";
  }
  text += "\n  },\n  \"columns\": [";
  separator = "";
  for (const std::string& name : column_names(trajectory)) {
    text += separator + text_literal(name);
    separator = ", ";
  }
  text += "],\n  \"rows\": [";
  std::vector<double> values;
  for (std::size_t row = 0; row < trajectory.rows.size(); ++row) {
    row_values(trajectory, row, values);
    text += row == 0 ? "\n    [" : ",\n    [";
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (i > 0) text += ", ";
      append_number(values[i], "null", text);
    }
    text += ']';
  }
  return text + "\n  ]\n}\n";
}

Result<Trajectory> parse_json(std::string_view text, std::string_view source) {
  const json root = json::parse(text, nullptr, false);
  if (root.is_discarded()) return malformed(source, "is no JSON");
  for (const char* key : {"about", "columns", "rows"}) {
    if (!root.is_object() || !root.contains(key)) return malformed(source, std::string("has no \"") + key + "\"");
  }
  if (!root["about"].is_object() || !root["columns"].is_array() || !root["rows"].is_array()) {
    return malformed(source, "\"about\" must be an object, \"columns\" and \"rows\" lists");
  }
  Trajectory trajectory;
  for (const auto& [key, value] : root["about"].items()) {
    if (!value.is_string() || !set_about(key, value.get<std::string>(), trajectory)) {
      return malformed(source, "\"about\": \"" + key.substr(0, 40) + "\" is not acceptable");
    }
  }
  std::vector<std::string> names;
  for (const json& name : root["columns"]) {
    if (!name.is_string()) return malformed(source, "\"columns\" must be texts");
    names.push_back(name.get<std::string>());
  }
  if (const Status known = set_columns(names, trajectory); !known) {
    return malformed(source, std::string(known.error().detail.view()));
  }
  std::vector<double> values;
  for (const json& row : root["rows"]) {
    const std::string why = read_row(row, names, values);
    if (!why.empty()) return malformed(source, "row " + std::to_string(trajectory.rows.size() + 1) + ": " + why);
    append_row(values, trajectory);
  }
  return trajectory;
}

}  // namespace embody::convert
