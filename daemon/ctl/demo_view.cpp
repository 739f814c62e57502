#include "daemon/ctl/demo_view.hpp"

#include <array>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include <spdlog/fmt/fmt.h>

namespace embody::ctl {
namespace {

using nlohmann::json;

constexpr std::array<const char*, 5> kFingers{"thumb", "index", "middle", "ring", "little"};
/// Along the data path, then the finger path beside it.
constexpr std::array<const char*, 8> kStages{"decode", "hand_pose", "phase_wait",  "arm",
                                             "write",  "total",     "finger_wait", "fingers"};

json parse(const std::string& text) {
  json value = json::parse(text, nullptr, /*allow_exceptions=*/false);
  return value.is_object() ? value : json::object();
}

/// Number at a path like "rates_hz/arm"; NaN when it is missing.
double number(const json& value, const std::string& path) {
  const json::json_pointer pointer("/" + path);
  return value.contains(pointer) && value[pointer].is_number() ? value[pointer].get<double>() : std::nan("");
}

std::string text(const json& value, const std::string& path) {
  const json::json_pointer pointer("/" + path);
  return value.contains(pointer) && value[pointer].is_string() ? value[pointer].get<std::string>() : "-";
}

template <class... Args>
void add(std::string& out, fmt::format_string<Args...> format, Args&&... args) {
  fmt::format_to(std::back_inserter(out), format, std::forward<Args>(args)...);
}

void add_latency(std::string& out, const json& latency) {
  add(out, "  latency [us]     {:>10} {:>10} {:>10} {:>10}\n", "median", "p99", "p99.9", "max");
  for (const char* stage : kStages) {
    if (!latency.contains(stage)) continue;  // nothing measured yet
    const std::string path = std::string(stage) + "/";
    add(out, "    {:<14} {:10.1f} {:10.1f} {:10.1f} {:10.1f}\n", stage, number(latency, path + "p50"),
        number(latency, path + "p99"), number(latency, path + "p999"), number(latency, path + "max"));
  }
}

void add_residuals(std::string& out, const json& residual) {
  add(out, "  marker residual [mm] ");
  for (const char* finger : kFingers) add(out, " {} {:.2f}", finger, number(residual, finger));
  add(out, "\n");
}

}  // namespace

std::string live_table(const std::string& status, const DemoProgress& progress) {
  const json s = parse(status);
  std::string out;
  add(out, "  {:<44} {:6.1f} / {:.1f} s\n", ("mode " + text(s, "mode/name") + "  " + text(s, "mode/cause")).c_str(),
      progress.elapsed_s, progress.duration_s);
  add(out, "  rates [Hz]        tracker {:.1f}   arm {:.1f}   fingers {:.1f}   hand {:.1f}\n",
      number(s, "rates_hz/tracker"), number(s, "rates_hz/arm"), number(s, "rates_hz/fingers"),
      number(s, "rates_hz/hand"));
  add(out, "  tracking error    arm {:.1f} mm, {:.3f} rad   hand {:.3f} rad   (now, lag included)\n",
      number(s, "tracking/arm_error_mm"), number(s, "tracking/arm_error_rad"), number(s, "tracking/hand_error_rad"));
  add_residuals(out, s.value("marker_residual_mm", json::object()));
  add(out, "  holds {:.0f}   heap allocations of real-time threads {:.0f}\n", number(s, "counters/holds"),
      number(s, "counters/rt_heap_allocations"));
  add_latency(out, s.value("latency_us", json::object()));
  return out;
}

std::string live_line(const std::string& status, const DemoProgress& progress) {
  const json s = parse(status);
  std::string out;
  if (!s.contains("/latency_us/total"_json_pointer)) {
    add(out, "{:5.1f} s  {:<8} {}\n", progress.elapsed_s, text(s, "mode/name").c_str(), text(s, "mode/cause").c_str());
    return out;
  }
  add(out,
      "{:5.1f} s  {:<8} tracker {:5.1f} Hz  arm {:5.1f} Hz  hand {:4.1f} Hz  total p50 {:.0f} us  arm error {:.1f} mm  "
      "hand {:.3f} "
      "rad\n",
      progress.elapsed_s, text(s, "mode/name").c_str(), number(s, "rates_hz/tracker"), number(s, "rates_hz/arm"),
      number(s, "rates_hz/hand"), number(s, "latency_us/total/p50"), number(s, "tracking/arm_error_mm"),
      number(s, "tracking/hand_error_rad"));
  return out;
}

std::string summary_json(const std::string& report_text, const std::string& status_before,
                         const std::string& status_after, double played_s, const DemoProgress& progress) {
  const json report = parse(report_text);
  const json before = parse(status_before);
  const json after = parse(status_after);
  const json counters = after.value("counters", json::object());
  const auto rate = [&](const char* counter) {
    const std::string path = std::string("counters/") + counter;
    return played_s > 0.0 ? (number(after, path) - number(before, path)) / played_s : 0.0;
  };
  json summary;
  for (const char* key :
       {"frames_received", "frames_used", "finger_frames", "finger_skipped", "robot_packages", "robot_packages_skipped",
        "arm_commands", "arm_commands_dropped", "hand_commands", "holds", "rt_heap_allocations"}) {
    summary[key] = counters.value(key, 0);
  }
  for (const char* key : {"frames_sent", "frames_in_recording", "followed", "reason", "judged_s", "first_tracking_s",
                          "engaged_fraction", "arm_lag_ms", "arm_error_mm", "arm_error_rad", "hand_lag_ms",
                          "hand_error_rad", "path_ratio", "largest_joint_speed_rad_s"}) {
    summary[key] = report.value(key, json());
  }
  summary["sequence_gaps"] = report.value("ur", json::object()).value("sequence_gaps", 0);
  summary["re_engagements"] = progress.re_engagements;
  summary["resets"] = progress.resets;
  summary["arm_rate_hz"] = rate("arm_commands");
  summary["hand_rate_hz"] = rate("hand_commands");
  summary["played_s"] = played_s;
  summary["latency_us"] = after.value("latency_us", json::object());
  summary["resample_delay_ms"] = after.value("resample_delay_ms", 0);
  summary["marker_residual_mm"] = after.value("marker_residual_mm", json::object());
  summary["realtime"] = after.value("realtime", json::object());
  if (summary["followed"].is_null()) summary["followed"] = false;
  return summary.dump(2);
}

std::string summary_text(const std::string& summary) {
  const json s = parse(summary);
  std::string out;
  add(out, "  frames            sent {:.0f}, received {:.0f}, used {:.0f}; fingers solved {:.0f}, skipped {:.0f}\n",
      number(s, "frames_sent"), number(s, "frames_received"), number(s, "frames_used"), number(s, "finger_frames"),
      number(s, "finger_skipped"));
  add(out, "  arm               {:.0f} commands to {:.0f} robot packages, {:.0f} gaps in their sequence; {:.1f} Hz\n",
      number(s, "arm_commands"), number(s, "robot_packages"), number(s, "sequence_gaps"), number(s, "arm_rate_hz"));
  add(out, "  hand              {:.0f} commands, {:.1f} Hz\n", number(s, "hand_commands"), number(s, "hand_rate_hz"));
  add(out,
      "  real time         {:.0f} heap allocations on real-time threads, {:.0f} holds and stops ({:.0f} re-engaged, "
      "{:.0f} reset)\n",
      number(s, "rt_heap_allocations"), number(s, "holds"), number(s, "re_engagements"), number(s, "resets"));
  add_residuals(out, s.value("marker_residual_mm", json::object()));
  add_latency(out, s.value("latency_us", json::object()));
  add(out, "  plant vs target   arm {:.1f} mm and {:.3f} rad (p95) at {:.0f} ms lag, path ratio {:.3f}\n",
      number(s, "arm_error_mm"), number(s, "arm_error_rad"), number(s, "arm_lag_ms"), number(s, "path_ratio"));
  add(out, "                    hand {:.3f} rad (p95) at {:.0f} ms lag\n", number(s, "hand_error_rad"),
      number(s, "hand_lag_ms"));
  add(out, "                    tracking {:.1f} % of {:.1f} s judged; the lag includes {:.0f} ms of resampling\n",
      100.0 * number(s, "engaged_fraction"), number(s, "judged_s"), number(s, "resample_delay_ms"));
  const bool followed = s.value("followed", false);
  out += followed ? "  followed          yes\n" : "  followed          NO: " + text(s, "reason") + "\n";
  return out;
}

}  // namespace embody::ctl
