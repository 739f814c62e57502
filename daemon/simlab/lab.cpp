#include "daemon/simlab/lab.hpp"

#include <nlohmann/json.hpp>

#include "core/robot/ur_kinematics.hpp"
#include "daemon/app/devices.hpp"
#include "drivers/recording/tsv_recording.hpp"

namespace embody::sim {
namespace {

/// Pose of the arm on a usual branch (elbow up, wrist down) from which the first target is a short way.
Result<Vector6> start_joints(const Models& models, const recording::Recording& recording,
                             const Eigen::Vector3d& offset_m) {
  for (std::size_t i = 0; i < recording.frames.size(); ++i) {
    const std::vector<TargetSample> targets = ungated_targets(models, recording, {{i, TimePoint{}}});
    if (targets.empty()) continue;  // the hand is not visible yet
    Pose X_BE = targets.front().X_BE;
    X_BE.translation() += offset_m;
    const Vector6 q_usual(0.0, -1.5708, 1.5708, -1.5708, -1.5708, 0.0);
    robot::UrJointRange range;
    range.lower_rad = models.arm.joints.lower_rad;
    range.upper_rad = models.arm.joints.upper_rad;
    Result<Vector6> q = robot::solve_nearest(X_BE, q_usual, range, models.arm.geometry);
    if (q.ok()) return q;
    return make_error(Errc::kInvalidArgument,
                      "the recording starts out of the arm's reach in this cell (%s): change [cell] p_WB_m",
                      q.error().detail.c_str());
  }
  return make_error(Errc::kInvalidArgument, "the three markers on the back of the hand are never visible together");
}

UrControllerConfig ur_config(const config::ArmConfig& arm, const recording::Recording& recording, const LabConfig& lab,
                             const Vector6& q_start_rad) {
  UrControllerConfig config;
  config.address = lab.address;
  config.port = lab.ur_port;
  config.robot.q_start_rad = q_start_rad;
  config.primary_port = lab.ur_primary_port;
  config.dashboard_port = lab.ur_dashboard_port;
  config.model = robot::model_of(arm.model).name;
  config.robot.program = control_script_config(arm);
  const double seconds = static_cast<double>(recording.frames.size()) / recording.rate_hz + 120.0;
  config.log_capacity = static_cast<std::size_t>(seconds * config.frequency_hz);
  return config;
}

MiaSimulatorConfig mia_config(const recording::Recording& recording, const LabConfig& lab) {
  MiaSimulatorConfig config;
  config.link = lab.mia_link;
  config.log_capacity =
      static_cast<std::size_t>((static_cast<double>(recording.frames.size()) / recording.rate_hz + 120.0) * 100.0);
  return config;
}

QtmServerConfig qtm_config(const LabConfig& lab) {
  QtmServerConfig config;
  config.address = lab.address;
  config.port = lab.qtm_port;
  return config;
}
}  // namespace

Result<std::unique_ptr<Lab>> Lab::create(const config::EmbodyConfig& config, const LabConfig& lab) {
  Result<Models> models = make_models(config);
  if (!models) return models.error();
  Result<recording::Recording> recording = recording::load_tsv(lab.recording);
  if (!recording) return recording.error();
  if (const Status complete = recording::require_markers(*recording, config.glove.names); !complete) {
    return make_error(complete.error().code, "%s: %s", lab.recording.c_str(), complete.error().detail.c_str());
  }
  if (lab.duration_s > 0.0) {
    const auto frames = static_cast<std::size_t>(lab.duration_s * recording->rate_hz);
    recording->frames.resize(std::min(recording->frames.size(), std::max<std::size_t>(frames, 1)));
  }
  const Result<Vector6> q_start = start_joints(*models, *recording, lab.start_offset_m);
  if (!q_start)
    return make_error(q_start.error().code, "%s: %s", lab.recording.c_str(), q_start.error().detail.c_str());
  return std::unique_ptr<Lab>(new Lab(config.arm, std::move(*models), std::move(*recording), lab, *q_start));
}

Lab::Lab(const config::ArmConfig& arm, Models models, recording::Recording recording, const LabConfig& lab,
         const Vector6& q_start_rad)
    : models_(std::move(models)),
      recording_(std::move(recording)),
      qtm_(qtm_config(lab), recording_),
      ur_(ur_config(arm, recording_, lab, q_start_rad)),
      mia_(mia_config(recording_, lab)) {}

Status Lab::start() {
  if (Status status = qtm_.start(); !status) return status;
  if (Status status = ur_.start(); !status) return status;
  return mia_.start();
}

bool Lab::all_devices_in_use() const {
  return qtm_.has_streaming_client() && ur_.has_client() && mia_.counters().reads > 2;
}

void Lab::play() {
  qtm_.play();
}

Status Lab::fault(const std::string& command) {
  const std::size_t end = std::min(command.find(' '), command.size());
  const std::string_view device = std::string_view(command).substr(0, end);
  const std::string_view fault = std::string_view(command).substr(std::min(end + 1, command.size()));
  if (device == "qtm") return qtm_.fault(fault);
  if (device == "ur") return ur_.fault(fault);
  if (device == "mia") return mia_.fault(fault);
  return make_error(Errc::kInvalidArgument, "a fault begins with the device, qtm, ur or mia, not '%.40s'",
                    command.c_str());
}

std::string Lab::report_json() const {
  const std::vector<SentFrame> sent = qtm_.log();
  FollowCriteria criteria;
  criteria.arm = models_.arm.geometry;
  criteria.planned = from_seconds(static_cast<double>(recording_.frames.size()) / recording_.rate_hz);
  const FollowReport report = judge(ungated_targets(models_, recording_, sent), ur_.samples(), mia_.log(), criteria);
  const UrCounters ur = ur_.counters();
  const UrSample arm = ur_.latest();
  const MiaSimulatorCounters mia = mia_.counters();
  const nlohmann::json json{{"followed", report.followed},
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
                            {"largest_joint_speed_rad_s", report.largest_joint_speed_rad_s},
                            {"frames_sent", sent.size()},
                            {"frames_in_recording", recording_.frames.size()},
                            {"arm_now",
                             {{"q_rad", std::vector<double>(arm.q_rad.begin(), arm.q_rad.end())},
                              {"speed_rad_s", arm.qd_rad_s.cwiseAbs().maxCoeff()},
                              {"tracking", arm.program_state == ProgramState::kTracking}}},
                            {"hand_now", {{"q_rad", mia_.joint_angles_rad()}}},
                            {"ur",
                             {{"packages_sent", ur.packages_sent},
                              {"command_packages", ur.command_packages},
                              {"sequence_gaps", ur.sequence_gaps},
                              {"sequence_duplicates", ur.sequence_duplicates},
                              {"late_cycles", ur.late_cycles},
                              {"bad_packages", ur.bad_packages},
                              {"clients_accepted", ur.clients_accepted}}},
                            {"mia",
                             {{"commands", mia.commands},
                              {"motions", mia.motions},
                              {"reads", mia.reads},
                              {"stops", mia.stops},
                              {"dropped_as_early", mia.dropped_as_early}}}};
  return json.dump();
}

}  // namespace embody::sim
