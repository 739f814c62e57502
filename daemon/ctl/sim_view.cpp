#include <cstdio>
#include <nlohmann/json.hpp>

#include "daemon/ctl/sim_view.hpp"
#include "daemon/ctl/status_table.hpp"

namespace embody::ctl {
namespace {

using json = nlohmann::ordered_json;

json parsed(const std::string& text) {
  json value = json::parse(text, nullptr, false);
  return value.is_object() ? value : json::object();
}

/// Member of an object that may be missing or of another type.
json member(const json& value, const char* key) {
  const auto found = value.is_object() ? value.find(key) : value.end();
  return value.is_object() && found != value.end() ? *found : json();
}

std::string text(const json& value) {
  return value.is_string() ? printable(value.get<std::string>()) : "-";
}

std::string number(const json& value, const char* format) {
  char buffer[64];
  if (!value.is_number()) return "-";
  std::snprintf(buffer, sizeof buffer, format, value.get<double>());
  return buffer;
}

std::string yes_no(const json& value, const char* yes, const char* no) {
  return value.is_boolean() && value.get<bool>() ? yes : no;
}

std::string angles(const json& value) {
  std::string result;
  if (!value.is_array()) return "-";
  for (const auto& angle : value) result += (result.empty() ? "" : " ") + number(angle, "%.2f");
  return result + " rad";
}

std::string row(const char* label, const std::string& content) {
  char start[24];
  std::snprintf(start, sizeof start, "%-10s", label);
  return start + content + "\n";
}

std::string in_use(const json& device) {
  return yes_no(member(device, "in_use"), "in use", "nobody there");
}

}  // namespace

std::string lab_status_text(const std::string& status) {
  const json s = parsed(status);
  const json qtm = member(s, "qtm"), ur = member(s, "ur"), hand = member(s, "hand");
  return row("playback", text(member(s, "playback")) + ", " + number(member(s, "frames_sent"), "%.0f") +
                             " frames sent of " + number(member(s, "frames_in_recording"), "%.0f") +
                             yes_no(member(s, "loop"), ", again and again", "")) +
         row("qtm", in_use(qtm) + ", port " + number(member(qtm, "port"), "%.0f")) +
         row("ur", in_use(ur) + ", port " + number(member(ur, "port"), "%.0f") + ", " + text(member(ur, "robot_mode")) +
                       ", safety " + text(member(ur, "safety")) + ", " +
                       yes_no(member(ur, "tracking"), "follows", "does not follow") + ", " +
                       number(member(ur, "speed_rad_s"), "%.3f rad/s")) +
         row("", angles(member(ur, "q_rad"))) +
         row(member(hand, "name").is_string() ? text(member(hand, "name")).c_str() : "hand",
             in_use(hand) + ", " + text(member(hand, "device")) + ", " + angles(member(hand, "q_rad")));
}

std::string lab_report_text(const std::string& report) {
  const json r = parsed(report);
  const std::string why = text(member(r, "reason"));
  return row("followed", yes_no(member(r, "followed"), "yes", "no") + (why.empty() ? "" : ": " + why)) +
         row("judged", number(member(r, "judged_s"), "%.1f s") + ", tracking in " +
                           number(member(r, "engaged_fraction"), "%.3f") + " of it") +
         row("arm", number(member(r, "arm_error_mm"), "%.1f mm") + " and " +
                        number(member(r, "arm_error_rad"), "%.3f rad") + " off in 95 %, " +
                        number(member(r, "arm_lag_ms"), "%.0f ms") + " late, path ratio " +
                        number(member(r, "path_ratio"), "%.3f")) +
         row("hand", number(member(r, "hand_error_rad"), "%.3f rad") + " off in 95 %, " +
                         number(member(r, "hand_lag_ms"), "%.0f ms") + " late");
}

std::string lab_faults_text(const std::string& faults) {
  std::string result;
  std::string device;
  for (const auto& fault : member(parsed(faults), "faults")) {
    const std::string of = text(member(fault, "device"));
    if (of != device) result += (result.empty() ? "" : "\n") + of + "\n";
    device = of;
    char words[64];
    std::snprintf(words, sizeof words, "  %-30s  ", text(member(fault, "fault")).c_str());
    result += words + text(member(fault, "meaning")) + "\n";
  }
  return result;
}

}  // namespace embody::ctl
