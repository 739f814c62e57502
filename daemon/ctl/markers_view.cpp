#include "daemon/ctl/markers_view.hpp"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "daemon/ctl/status_table.hpp"

namespace embody::ctl {
namespace {

using json = nlohmann::ordered_json;

constexpr const char* kUnreadable = "the daemon's answer is not readable by this version of embodyctl\n";
constexpr std::array<const char*, 5> kFingers{"thumb", "index", "middle", "ring", "little"};
/// Edges of the triangle on the back of the hand: key and text.
constexpr std::array<std::array<const char*, 2>, 3> kEdges{
    {{"top_left", "top-left"}, {"top_right", "top-right"}, {"left_right", "left-right"}}};

template <class... Args>
void add(std::string& out, fmt::format_string<Args...> format, Args&&... args) {
  fmt::format_to(std::back_inserter(out), format, std::forward<Args>(args)...);
}

const json& member(const json& object, const char* key) {
  static const json kNothing;
  if (!object.is_object()) return kNothing;
  const auto found = object.find(key);
  return found == object.end() ? kNothing : *found;
}

std::string text(const json& object, const char* key) {
  const json& value = member(object, key);
  return value.is_string() ? printable(value.get<std::string>()) : std::string();
}

bool flag(const json& object, const char* key) {
  const json& value = member(object, key);
  return value.is_boolean() && value.get<bool>();
}

/// A number with its unit, or a dash.
std::string number(const json& object, const char* key, int decimals, const char* unit) {
  const json& value = member(object, key);
  if (!value.is_number()) return "-";
  return fmt::format("{:.{}f}{}", value.get<double>(), decimals, unit);
}

std::string verdict(const json& marker) {
  const std::string from = text(marker, "from");
  const std::string name = text(marker, "verdict");
  return from.empty() ? name : name + " from " + from;
}

std::string place(const json& marker) {
  const std::string finger = text(marker, "finger");
  return finger.empty() ? "-" : finger + " " + text(marker, "point");
}

void add_rows(std::string& out, const json& markers) {
  add(out, "{:<18} {:<15} {:<11} {:<30} {:>10}\n", "marker", "place", "seen", "verdict", "off model");
  if (!markers.is_array()) return;
  for (const json& marker : markers) {
    const std::string seen = (flag(marker, "seen") ? "yes " : "no  ") + number(marker, "seen_percent", 0, " %");
    add(out, "{:<18} {:<15} {:<11} {:<30} {:>10}\n", text(marker, "label"), place(marker), seen, verdict(marker),
        number(marker, "residual_mm", 1, " mm"));
  }
}

void add_back(std::string& out, const json& back) {
  const std::string state = text(back, "state");
  add(out, "back of the hand   {}", state.empty() ? "-" : state);
  for (const auto& [key, name] : kEdges) {
    add(out, ", {} {}", name, number(member(back, "edges_mm"), key, 1, ""));
    if (member(member(back, "reference_mm"), key).is_number()) {
      add(out, " of {}", number(member(back, "reference_mm"), key, 1, ""));
    }
    out += " mm";
  }
  add(out, ", fit error {}{}\n", number(back, "fit_error_mm", 2, " mm"),
      flag(back, "ambiguous") ? " (two markers of this triangle cannot be told apart)" : "");
}

void add_fingers(std::string& out, const json& view) {
  add(out, "confidence         hand {}", number(member(view, "confidence"), "hand", 2, ""));
  for (const char* finger : kFingers) {
    add(out, ", {} {} {}", finger, number(member(view, "confidence"), finger, 2, ""),
        text(member(view, "quality"), finger));
  }
  out += '\n';
}

/// Calls `use` for each sentence.
template <class Use>
void for_findings(const json& view, Use&& use) {
  const json& findings = member(view, "findings");
  if (!findings.is_array()) return;
  for (const json& finding : findings) {
    if (finding.is_string()) use(printable(finding.get<std::string>()));
  }
}

}  // namespace

std::string markers_table(const std::string& json_text) {
  const json view = json::parse(json_text, nullptr, false);
  if (!view.is_object()) return kUnreadable;
  std::string out;
  add(out, "frame {}, {} in the last second\n", number(view, "frame_number", 0, ""), number(view, "frames", 0, ""));
  add_rows(out, member(view, "markers"));
  add_back(out, member(view, "back"));
  add_fingers(out, view);
  for_findings(view, [&](const std::string& finding) { add(out, "! {}\n", finding); });
  return out;
}

std::string markers_line(const std::string& json_text) {
  const json view = json::parse(json_text, nullptr, false);
  if (!view.is_object()) return kUnreadable;
  std::size_t seen = 0, all = 0;
  std::string unused;
  const json& markers = member(view, "markers");
  for (const json& marker : markers.is_array() ? markers : json::array()) {
    ++all;
    seen += flag(marker, "seen") ? 1 : 0;
    const std::string name = text(marker, "verdict");
    if (name == "used" || name == "none") continue;
    add(unused, "{}{} {}", unused.empty() ? "" : ", ", text(marker, "label"), verdict(marker));
  }
  std::string out;
  add(out, "frame {}: {} of {} markers seen, back {} ({}), confidence {}", number(view, "frame_number", 0, ""), seen,
      all, text(member(view, "back"), "state"), number(member(view, "back"), "fit_error_mm", 2, " mm"),
      number(member(view, "confidence"), "hand", 2, ""));
  if (!unused.empty()) add(out, "; {}", unused);
  for_findings(view, [&](const std::string& finding) { add(out, "; {}", finding); });
  return out + "\n";
}

}  // namespace embody::ctl
