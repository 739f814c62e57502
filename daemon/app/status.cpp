// The status object of the control socket (docs/control.md).
#include <map>
#include <nlohmann/json.hpp>

#include "daemon/app/daemon.hpp"
#include "daemon/app/hand_report.hpp"
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

/// Empty with a tracker of markers.
json landmarks_json(config::TrackerDriver driver, const Edges& edges) {
  if (driver != config::TrackerDriver::kLandmarks) return json::object();
  return {{"palm_scale", edges.palm_scale.load(std::memory_order_relaxed)}};
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

/// What is known of the human hand, and whether the robot hand acts on it.
json confidence_json(const TelemetrySnapshot& telemetry) {
  json confidence{{"hand", telemetry.hand_confidence}};
  for (std::size_t i = 0; i < kFingers; ++i) confidence[kFingerNames[i]] = telemetry.confidence[i];
  return confidence;
}

json quality_json(const std::array<FingerQuality, kFingers>& fingers) {
  constexpr std::array<const char*, 6> kQualityNames{"none", "optimal", "capped", "held", "at_limit", "lost"};
  json quality = json::object();
  for (std::size_t i = 0; i < kFingers; ++i) {
    quality[kFingerNames[i]] = kQualityNames[static_cast<std::size_t>(fingers[i])];
  }
  return quality;
}

json robot_hand_json(const TelemetrySnapshot& telemetry, const std::vector<std::string>& joints) {
  constexpr std::array<const char*, 3> kActionNames{"holds", "moves", "stopped"};
  json kept = json::array();
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if ((telemetry.kept_joints >> i & 1U) != 0) kept.push_back(joints[i]);
  }
  return {{"action", kActionNames[static_cast<std::size_t>(telemetry.hand_action)]},
          {"cause", safety::to_string(telemetry.hand_hold)},
          {"unsure_joints", kept}};
}

json marker_json(const MarkerRow& row) {
  json marker{{"label", row.label},
              {"finger", row.finger},
              {"point", row.point},
              {"seen", row.seen},
              {"seen_percent", 100.0 * row.seen_fraction},
              {"verdict", hand::kMarkerVerdictNames[static_cast<std::size_t>(row.verdict)]}};
  if (!row.source.empty()) marker["from"] = row.source;
  if (row.residual_m) marker["residual_mm"] = *row.residual_m * 1e3;
  if (row.seen) marker["p_W_m"] = {row.p_W.x(), row.p_W.y(), row.p_W.z()};
  return marker;
}

json back_json(const BackRow& back) {
  constexpr std::array<const char*, 3> kEdges{"top_left", "top_right", "left_right"};
  json edges = json::object(), reference = json::object();
  for (std::size_t i = 0; i < kEdges.size(); ++i) {
    if (back.edges_m[i]) edges[kEdges[i]] = *back.edges_m[i] * 1e3;
    if (back.reference_m[i] > 0.0) reference[kEdges[i]] = back.reference_m[i] * 1e3;
  }
  return {{"state", back.state},
          {"ambiguous", back.ambiguous},
          {"edges_mm", edges},
          {"reference_mm", reference},
          {"fit_error_mm", back.fit_error_m * 1e3}};
}

/// Delay that smoothing adds to the finger angles, net of prediction.
json filter_json(const Edges& edges, const config::FilterConfig& config) {
  json lag = json::object();
  for (std::size_t i = 0; i < kFingers; ++i) {
    lag[kFingerNames[i]] = to_seconds(Duration{edges.filter_lag_ns[i].load(std::memory_order_relaxed)}) * 1e3;
  }
  return {{"lag_ms", lag},
          {"lag_at_rest_ms", config.lag_at_rest.count()},
          {"lag_in_motion_ms", config.lag_in_motion.count()},
          {"predict_ms", config.predict.count()},
          {"predict_pose_ms", config.predict_pose.count()}};
}

/// Any thread may read them: the table is made with the driver, and the drivers live as long as the daemon.
json device_counters_json(const Device& device) {
  json counters = json::object();
  for (const NamedCounter& counter : device.named_counters()) counters[counter.name] = counter.value->get();
  return counters;
}

json devices_json(const std::vector<DeviceReport>& reports, const std::map<std::string, const Device*>& drivers) {
  json devices = json::object();
  for (const DeviceReport& report : reports) {
    devices[report.name] = {{"state", report.connected ? "connected" : "missing"},
                            {"peer", report.peer},
                            {"detail", report.detail},
                            {"sessions", report.sessions},
                            {"counters", device_counters_json(*drivers.at(report.name))}};
  }
  return devices;
}

}  // namespace

std::string Daemon::status_json() {
  const TelemetrySnapshot telemetry = telemetry_->snapshot();
  const safety::ModeState mode_now = mode();
  const std::map<std::string, const Device*> drivers{
      {"tracker", tracker_.get()}, {"arm", arm_.get()}, {"hand", hand_.get()}};
  const json status{{"version", kVersion},
                    {"uptime_s", to_seconds(transport::now() - t_start_)},
                    {"mode", mode_json(mode_now)},
                    {"devices", devices_json(links_->reports(), drivers)},
                    {"robot", robot_json(telemetry.arm)},
                    {"rates_hz",
                     {{"tracker", telemetry.tracker_hz},
                      {"arm", telemetry.arm_hz},
                      {"hand", telemetry.hand_hz},
                      {"fingers", telemetry.fingers_hz}}},
                    {"landmarks", landmarks_json(config_.tracker.driver, edges_)},
                    {"counters", counters_json(edges_, telemetry, mode_now)},
                    {"latency_us", latency_json(telemetry)},
                    {"resample_delay_ms", config_.arm.resample_delay.count()},
                    {"filter", filter_json(edges_, config_.record_mapping.filter)},
                    {"marker_residual_mm", residual_json(telemetry)},
                    {"confidence", confidence_json(telemetry)},
                    {"quality", quality_json(telemetry.quality)},
                    {"hand", hand_json(telemetry.hand, config_.hand.embodiment.motors)},
                    {"robot_hand", robot_hand_json(telemetry, config_.hand.embodiment.motors)},
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

std::string Daemon::markers_json() const {
  const TelemetrySnapshot telemetry = telemetry_->snapshot();
  const MarkersView& view = telemetry.markers;
  json markers{{"frame_number", view.frame_number},
               {"frames", view.frames},
               {"valid", view.valid},
               {"confidence", confidence_json(telemetry)},
               {"quality", quality_json(view.quality)},
               {"markers", json::array()},
               {"back", back_json(view.back)},
               {"findings", view.findings}};
  for (const MarkerRow& row : view.rows) markers["markers"].push_back(marker_json(row));
  return markers.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace embody
