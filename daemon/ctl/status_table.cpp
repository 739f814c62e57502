#include "daemon/ctl/status_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <set>

namespace embody::ctl {
namespace {

using json = nlohmann::ordered_json;  // the daemon's order is the order of the pipeline

constexpr std::size_t kLabelWidth = 11;
constexpr std::size_t kLineWidth = 100;

const json& member(const json& object, const char* key) {
  static const json kNothing;
  if (!object.is_object()) return kNothing;
  const auto found = object.find(key);
  return found == object.end() ? kNothing : *found;
}

std::string number_text(double value) {
  char text[40];
  std::snprintf(text, sizeof text, std::abs(value) < 1e15 ? "%.*f" : "%.*e", std::abs(value) < 10 ? 2 : 1, value);
  return text;
}

/// Any value on one line.
std::string text_of(const json& value) {
  if (value.is_null()) return "-";
  if (value.is_string()) return printable(value.get<std::string>());
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_number_float()) return number_text(value.get<double>());
  if (value.is_number()) return value.dump();
  return printable(value.dump(-1, ' ', false, json::error_handler_t::replace));
}

std::string duration_text(const json& seconds) {
  if (!seconds.is_number()) return "-";
  const double total = seconds.get<double>();
  if (!(total >= 60)) {
    char text[40];
    std::snprintf(text, sizeof text, "%.1f s", std::max(total, 0.0));
    return text;
  }
  const auto whole = static_cast<long long>(std::min(total, 1e15));
  const long long days = whole / 86400, hours = whole / 3600 % 24, minutes = whole / 60 % 60;
  if (days > 0) return std::to_string(days) + " d " + std::to_string(hours) + " h";
  if (hours > 0) return std::to_string(hours) + " h " + std::to_string(minutes) + " min";
  return std::to_string(minutes) + " min " + std::to_string(whole % 60) + " s";
}

std::string padded(std::string text, std::size_t width) {
  if (text.size() < width) text.append(width - text.size(), ' ');
  return text;
}

std::string right(const std::string& text, std::size_t width) {
  return text.size() < width ? std::string(width - text.size(), ' ') + text : text;
}

/// Lines with a label in front of the first.
class Table {
 public:
  void line(const std::string& label, const std::string& content) {
    text_ += padded(label == last_ ? "" : label, kLabelWidth) + content;
    text_.erase(text_.find_last_not_of(' ') + 1);
    text_ += '\n';
    last_ = label;
  }
  /// "name value" pairs, several per line.
  void pairs(const std::string& label, const json& object, const char* unit) {
    if (!object.is_object() || object.empty()) return;
    std::string content;
    for (const auto& [key, value] : object.items()) {
      const std::string item = printable(key) + " " + text_of(value);
      if (!content.empty() && content.size() + item.size() + 3 > kLineWidth) {
        line(label, content);
        content.clear();
      }
      content += (content.empty() ? "" : "   ") + item;
    }
    line(label, content + unit);
  }
  [[nodiscard]] std::string text() const { return text_; }

 private:
  std::string text_;
  std::string last_;
};

void add_mode(Table& table, const json& mode) {
  if (!mode.is_object()) return;
  std::string text = text_of(member(mode, "name"));
  const json& cause = member(mode, "cause");
  if (cause.is_string() && cause != "none" && cause != "") text += " (" + text_of(cause) + ")";
  if (member(mode, "since_s").is_number()) text += ", for " + duration_text(member(mode, "since_s"));
  table.line("mode", text);
}

void add_devices(Table& table, const json& devices) {
  if (!devices.is_object()) return;
  for (const auto& [name, device] : devices.items()) {
    table.line("devices", padded(printable(name), 9) + padded(text_of(member(device, "state")), 14) +
                              text_of(member(device, "peer")));
    if (const json& detail = member(device, "detail"); detail.is_string() && detail != "") {
      table.line("devices", padded("", 9) + text_of(detail));
    }
  }
}

void add_latency(Table& table, const json& latency) {
  constexpr std::array<const char*, 4> kColumns{"p50", "p99", "p999", "max"};
  if (!latency.is_object() || latency.empty()) return;
  std::size_t width = 16;
  for (const auto& stage : latency.items()) width = std::max(width, stage.key().size() + 2);
  std::string head = padded("us", width);
  for (const char* column : kColumns) head += right(column, 10);
  table.line("latency", head);
  for (const auto& [stage, values] : latency.items()) {
    std::string row = padded(printable(stage), width);
    for (const char* column : kColumns) row += right(text_of(member(values, column)), 10);
    table.line("latency", row);
  }
}

/// Counters of a device that have counted anything.
void add_device_counters(Table& table, const json& devices) {
  if (!devices.is_object()) return;
  for (const auto& [name, device] : devices.items()) {
    const json& all = member(device, "counters");
    if (!all.is_object()) continue;
    json counted = json::object();
    for (const auto& [counter, value] : all.items()) {
      if (value != 0) counted[counter] = value;
    }
    table.pairs(" " + printable(name), counted, "");  // below "counters"
  }
}

/// What the robot hand measures. Raw numbers have no unit that anybody documents.
void add_hand(Table& table, const json& hand) {
  if (!hand.is_object() || hand.empty()) return;
  std::string text = text_of(member(hand, "condition")) + ", supply " + text_of(member(hand, "supply"));
  if (const json& why = member(hand, "why_not"); why.is_string() && why != "") text += ": " + text_of(why);
  table.line("hand", text);
  if (const json& peer = member(hand, "peer"); peer.is_string()) table.line("hand", text_of(peer));
  table.pairs("positions", member(hand, "position_rad"), " rad");
  table.pairs("currents", member(hand, "current_a"), " A");
  table.pairs("currents", member(hand, "current_raw"), " (raw)");
  const json& force = member(hand, "force_raw");
  if (!force.is_object() || force.empty()) return;
  std::string forces;
  for (const auto& [finger, value] : force.items()) {
    forces +=
        printable(finger) + " " + text_of(member(value, "normal")) + "/" + text_of(member(value, "tangential")) + "   ";
  }
  table.line("forces", forces + "(raw, normal/tangential)");
}

/// Delay of each finger now, between which limits it moves, and what is predicted.
void add_filter(Table& table, const json& filter) {
  if (!filter.is_object()) return;
  std::string text = "lag";
  if (const json& lag = member(filter, "lag_ms"); lag.is_object()) {
    for (const auto& [finger, ms] : lag.items()) text += " " + printable(finger) + " " + text_of(ms);
  }
  const auto ahead = [&filter](const char* key) {
    const json& ms = member(filter, key);
    return ms.is_number() && ms == 0 ? std::string("off") : text_of(ms) + " ms";
  };
  table.line("filter", text + " ms (" + text_of(member(filter, "lag_at_rest_ms")) + " at rest, " +
                           text_of(member(filter, "lag_in_motion_ms")) + " in motion)");
  table.line("filter", "prediction: fingers " + ahead("predict_ms") + ", hand pose " + ahead("predict_pose_ms"));
}

void add_realtime(Table& table, const json& realtime) {
  if (!realtime.is_object()) return;
  const auto flag = [&realtime](const char* key, const char* yes, const char* no) {
    const json& value = member(realtime, key);
    return value.is_boolean() ? std::string(", ") + (value.get<bool>() ? yes : no) : std::string();
  };
  table.line("realtime", text_of(member(realtime, "mode")) +
                             flag("scheduled", "real-time scheduling", "no real-time scheduling") +
                             flag("locked", "memory locked", "memory not locked"));
  if (const json& warning = member(realtime, "warning"); warning.is_string() && warning != "") {
    table.line("realtime", "warning: " + text_of(warning));
  }
}

}  // namespace

std::string printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
  return text;
}

std::string status_table(const std::string& json_text) {
  const json status = json::parse(json_text, nullptr, false);
  if (!status.is_object()) return "the daemon's status is not readable by this version of embodyctl\n";
  Table table;
  std::string head = text_of(member(status, "version"));
  if (member(status, "uptime_s").is_number()) head += ", up " + duration_text(member(status, "uptime_s"));
  table.line("embodyd", head);
  add_mode(table, member(status, "mode"));
  add_devices(table, member(status, "devices"));
  table.pairs("robot", member(status, "robot"), "");
  table.pairs("rates", member(status, "rates_hz"), " Hz");
  table.pairs("residuals", member(status, "marker_residual_mm"), " mm");
  add_filter(table, member(status, "filter"));
  table.pairs("confidence", member(status, "confidence"), "");
  table.pairs("quality", member(status, "quality"), "");
  add_hand(table, member(status, "hand"));
  table.pairs("robot hand", member(status, "robot_hand"), "");
  table.pairs("tracking", member(status, "tracking"), "");
  add_latency(table, member(status, "latency_us"));
  add_realtime(table, member(status, "realtime"));
  table.pairs("landmarks", member(status, "landmarks"), "");
  table.pairs("counters", member(status, "counters"), "");
  add_device_counters(table, member(status, "devices"));

  static const std::set<std::string> kKnown{
      "version",  "uptime_s",           "mode",     "devices", "rates_hz",  "counters", "latency_us",
      "realtime", "marker_residual_mm", "tracking", "robot",   "landmarks", "filter",   "confidence",
      "quality",  "robot_hand",         "hand"};
  json others = json::object();
  for (const auto& [key, value] : status.items()) {
    if (kKnown.count(key) == 0) others[key] = value;
  }
  table.pairs("other", others, "");
  return table.text();
}

std::string hand_table(const std::string& json_text) {
  Table table;
  add_hand(table, json::parse(json_text, nullptr, false));
  return table.text();
}

}  // namespace embody::ctl
