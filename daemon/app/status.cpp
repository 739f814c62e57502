// The status object of the control socket (docs/control.md).
#include <nlohmann/json.hpp>

#include "daemon/app/daemon.hpp"
#include "daemon/app/heap_guard.hpp"
#include "daemon/app/version.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/ur_rtde/status_text.hpp"

namespace embody {
namespace {

using json = nlohmann::ordered_json;  // members appear in the order of the data path

std::uint64_t value(const std::atomic<std::uint64_t>& counter) {
  return counter.load(std::memory_order_relaxed);
}

json mode_json(const safety::ModeState& mode) {
  return {{"name", safety::to_string(mode.mode)},
          {"cause", safety::to_string(mode.cause)},
          {"since_s", to_seconds(transport::now() - mode.t_since)},
          {"epoch", mode.epoch}};
}

json counters_json(const Edges& edges, const TelemetrySnapshot& telemetry, const safety::ModeState& mode) {
  const LoopCounters& c = edges.counters;
  return {{"frames_received", value(c.frames_received)},
          {"frames_used", value(c.frames_used)},
          {"poses_invalid", value(c.poses_invalid)},
          {"poses_superseded", value(c.poses_superseded)},
          {"finger_frames", value(c.finger_frames)},
          {"finger_skipped", value(c.finger_skipped)},
          {"robot_packages", value(c.robot_packages)},
          {"robot_packages_skipped", value(c.robot_packages_skipped)},
          {"arm_commands", value(c.arm_commands)},
          {"arm_commands_dropped", value(c.arm_commands_dropped)},
          {"hand_commands", value(c.hand_commands)},
          {"hand_replies", value(c.hand_replies)},
          {"hand_cycles_late", value(c.hand_cycles_late)},
          {"holds", mode.holds},
          {"timings_dropped", edges.arm_timings.dropped() + edges.finger_timings.dropped()},
          {"dds_published", telemetry.dds_published},
          {"dds_failed", telemetry.dds_failed},
          {"rt_heap_allocations", heap_guard::count()}};
}

json latency_json(const TelemetrySnapshot& telemetry) {
  json stages = json::object();
  for (std::size_t i = 0; i < kStageNames.size(); ++i) {
    const Histogram& histogram = telemetry.latency[i];
    if (histogram.count() == 0) continue;
    stages[kStageNames[i]] = {{"count", histogram.count()},           {"p50", histogram.quantile_us(0.5)},
                              {"p90", histogram.quantile_us(0.9)},    {"p99", histogram.quantile_us(0.99)},
                              {"p999", histogram.quantile_us(0.999)}, {"max", histogram.max_us()}};
  }
  return stages;
}

/// What the arm's controller says about itself.
json robot_json(const ArmState& arm) {
  if (arm.package == 0) return json::object();
  return {{"mode", rtde::robot_mode_text(arm.robot_mode)},
          {"safety", rtde::safety_text(arm.safety_status)},
          {"program", arm.program_fault == 0 ? "no fault" : rtde::program_fault_text(arm.program_fault)},
          {"speed_scaling", arm.speed_scaling}};
}

json residual_json(const TelemetrySnapshot& telemetry) {
  json residual = json::object();
  for (std::size_t i = 0; i < kFingers; ++i) residual[kFingerNames[i]] = telemetry.residual_mean_m[i] * 1e3;
  return residual;
}

json devices_json(const std::vector<DeviceReport>& reports) {
  json devices = json::object();
  for (const DeviceReport& report : reports) {
    devices[report.name] = {{"state", report.connected ? "connected" : "missing"},
                            {"peer", report.peer},
                            {"detail", report.detail},
                            {"sessions", report.sessions}};
  }
  return devices;
}

}  // namespace

std::string Daemon::status_json() {
  const TelemetrySnapshot telemetry = telemetry_->snapshot();
  const safety::ModeState mode_now = mode();
  const json status{{"version", kVersion},
                    {"uptime_s", to_seconds(transport::now() - t_start_)},
                    {"mode", mode_json(mode_now)},
                    {"devices", devices_json(links_->reports())},
                    {"robot", robot_json(telemetry.arm)},
                    {"rates_hz",
                     {{"tracker", telemetry.tracker_hz},
                      {"arm", telemetry.arm_hz},
                      {"hand", telemetry.hand_hz},
                      {"fingers", telemetry.fingers_hz}}},
                    {"counters", counters_json(edges_, telemetry, mode_now)},
                    {"latency_us", latency_json(telemetry)},
                    {"resample_delay_ms", config_.arm.resample_delay.count()},
                    {"marker_residual_mm", residual_json(telemetry)},
                    {"tracking",
                     {{"arm_error_mm", telemetry.arm_error_m * 1e3},
                      {"arm_error_rad", telemetry.arm_error_rad},
                      {"hand_error_rad", telemetry.hand_error_rad}}},
                    {"realtime",
                     {{"mode", config::kRealtimeModeNames[static_cast<std::size_t>(config_.realtime.mode)]},
                      {"scheduled", realtime_.scheduled},
                      {"locked", realtime_.locked},
                      {"heap_counted", heap_guard::active()},
                      {"warning", realtime_.warning}}}};
  return status.dump(-1, ' ', false, json::error_handler_t::replace);  // devices may say anything
}

}  // namespace embody
