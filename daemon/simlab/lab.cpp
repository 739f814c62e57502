#include "daemon/simlab/lab.hpp"

#include <algorithm>
#include <utility>

#include "core/robot/ur_kinematics.hpp"
#include "daemon/app/devices.hpp"
#include "drivers/recording/tsv_recording.hpp"
#include "drivers/transport/clock.hpp"

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

HandOptions hand_options(const recording::Recording& recording, const LabConfig& lab) {
  HandOptions options;
  options.link = lab.mia_link;
  options.mia_generation = lab.mia_generation;
  options.log_length_s = static_cast<double>(recording.frames.size()) / recording.rate_hz + 120.0;
  return options;
}

QtmServerConfig qtm_config(const LabConfig& lab) {
  QtmServerConfig config;
  config.address = lab.address;
  config.port = lab.qtm_port;
  config.loop = lab.loop;
  return config;
}

Status check_tracker(const config::EmbodyConfig& config) {
  if (config.tracker.driver == config::TrackerDriver::kQualisys) return {};
  return make_error(
      Errc::kInvalidArgument,
      "the lab plays a recording of markers: [tracker] driver must be \"qualisys\"; landmarks are sent by "
      "'embody-sim landmarks'");
}

}  // namespace

Result<std::unique_ptr<Lab>> Lab::create(const config::EmbodyConfig& config, const LabConfig& lab) {
  if (const Status simulated = check_tracker(config); !simulated) return simulated.error();
  if (const Status fit = check_devices(config); !fit) return fit.error();
  Result<Models> models = make_models(config);
  if (!models) return models.error();
  Result<recording::Recording> recording = recording::load_tsv(lab.recording);
  if (!recording) return recording.error();
  if (const Status complete = recording::require_markers(*recording, config.glove.names); !complete) {
    return make_error(complete.error().code, "%s: %s", lab.recording.c_str(), complete.error().detail.c_str());
  }
  if (lab.duration_s > 0.0) {
    const auto all = static_cast<double>(recording->frames.size());
    recording->frames.resize(static_cast<std::size_t>(std::clamp(lab.duration_s * recording->rate_hz, 1.0, all)));
  }
  const Result<Vector6> q_start = start_joints(*models, *recording, lab.start_offset_m);
  if (!q_start)
    return make_error(q_start.error().code, "%s: %s", lab.recording.c_str(), q_start.error().detail.c_str());
  auto hand = make_simulated_hand(config, hand_options(*recording, lab));
  return std::unique_ptr<Lab>(
      new Lab(config.arm, std::move(*models), std::move(*recording), lab, *q_start, std::move(hand)));
}

Lab::Lab(const config::ArmConfig& arm, Models models, recording::Recording recording, const LabConfig& lab,
         const Vector6& q_start_rad, std::unique_ptr<SimulatedHand> hand)
    : models_(std::move(models)),
      loop_(lab.loop),
      recording_(std::move(recording)),
      qtm_(qtm_config(lab), recording_),
      ur_(ur_config(arm, recording_, lab, q_start_rad)),
      hand_(std::move(hand)) {}

Status Lab::start() {
  // A hand by DDS shuts strangers out of every UDP socket that appears while it opens its domain: it comes first.
  if (Status status = hand_->start(); !status) return status;
  if (Status status = qtm_.start(); !status) return status;
  return ur_.start();
}

bool Lab::all_devices_in_use() const {
  return qtm_.has_streaming_client() && ur_.has_client() && hand_->in_use();
}

void Lab::play() {
  if (!t_play_) t_play_ = transport::now();
  qtm_.play();
}

}  // namespace embody::sim
