// What the lab tells about itself, as JSON.
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/robot/ur_kinematics.hpp"
#include "daemon/simlab/lab.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/ur_rtde/status_text.hpp"

namespace embody::sim {
namespace {

using nlohmann::json;

json arm_json(const UrSample& arm) {
  return {{"q_rad", std::vector<double>(arm.q_rad.begin(), arm.q_rad.end())},
          {"speed_rad_s", arm.qd_rad_s.cwiseAbs().maxCoeff()},
          {"tracking", arm.program_state == ProgramState::kTracking}};
}

json ur_json(const UrCounters& ur) {
  return {{"packages_sent", ur.packages_sent},      {"command_packages", ur.command_packages},
          {"sequence_gaps", ur.sequence_gaps},      {"sequence_duplicates", ur.sequence_duplicates},
          {"late_cycles", ur.late_cycles},          {"bad_packages", ur.bad_packages},
          {"clients_accepted", ur.clients_accepted}};
}

json hand_json(const SimulatedHand& hand) {
  json counters = json::object();
  for (const auto& [name, value] : hand.counters()) counters[name] = value;
  return counters;
}

json report_json_of(const FollowReport& report) {
  return {{"followed", report.followed},
          {"reason", report.reason},
          {"judged_s", report.judged_s},
          {"first_tracking_s", report.first_tracking_s},
          {"engaged_fraction", report.engaged_fraction},
          {"arm_lag_ms", report.arm_lag_s * 1e3},
          {"arm_error_mm", report.arm_error_m * 1e3},
          {"arm_error_rad", report.arm_error_rad},
          {"hand_lag_ms", report.hand_lag_s * 1e3},
          {"hand_error_rad", std::isfinite(report.hand_error_rad) ? report.hand_error_rad : -1.0},
          {"path_ratio", report.path_ratio},
          {"largest_joint_speed_rad_s", report.largest_joint_speed_rad_s}};
}

}  // namespace

FollowReport Lab::judge_now(const std::vector<SentFrame>& sent) const {
  FollowCriteria criteria;
  criteria.arm = models_.arm.geometry;
  if (!loop_) criteria.planned = from_seconds(static_cast<double>(recording_.frames.size()) / recording_.rate_hz);
  return judge(ungated_targets(models_, recording_, sent), ur_.samples(), hand_->log(), criteria);
}

std::string Lab::report_json() const {
  const std::vector<SentFrame> sent = qtm_.log();
  json report = report_json_of(judge_now(sent));
  report["frames_sent"] = sent.size();
  report["frames_in_recording"] = recording_.frames.size();
  report["arm_now"] = arm_json(ur_.latest());
  report["hand_now"] = {{"q_rad", hand_->joint_angles_rad()}};
  report["ur"] = ur_json(ur_.counters());
  report[hand_->name()] = hand_json(*hand_);
  return report.dump();
}

std::string Lab::status_json() const {
  const SafetyStatus safety = ur_.safety();
  json arm = arm_json(ur_.latest());
  arm.update({{"port", ur_.port()},
              {"primary_port", ur_.primary_port()},
              {"dashboard_port", ur_.dashboard_port()},
              {"in_use", ur_.has_client()},
              {"robot_mode", rtde::robot_mode_text(safety.robot_mode)},
              {"safety", rtde::safety_text(safety.safety_status)},
              {"counters", ur_json(ur_.counters())}});
  const json status{{"playback", !t_play_     ? "waiting"
                                 : finished() ? "finished"
                                              : "playing"},
                    {"playing_s", t_play_ ? to_seconds(transport::now() - *t_play_) : 0.0},
                    {"frames_sent", qtm_.frames_sent()},
                    {"frames_in_recording", recording_.frames.size()},
                    {"rate_hz", recording_.rate_hz},
                    {"loop", loop_},
                    {"qtm", {{"port", qtm_.port()}, {"in_use", qtm_.has_streaming_client()}}},
                    {"ur", arm},
                    {"hand",
                     {{"name", hand_->name()},
                      {"device", hand_->device()},
                      {"in_use", hand_->in_use()},
                      {"q_rad", hand_->joint_angles_rad()},
                      {"counters", hand_json(*hand_)}}}};
  return status.dump();
}

}  // namespace embody::sim
