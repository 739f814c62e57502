#include "daemon/loops/telemetry_loop.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "core/robot/ur_kinematics.hpp"
#include "drivers/transport/clock.hpp"

namespace embody {
namespace {

constexpr auto kMarkersPeriod = std::chrono::milliseconds(100);
constexpr auto kHandPeriod = std::chrono::milliseconds(100);
constexpr auto kRelaxed = std::memory_order_relaxed;
constexpr std::array<const char*, 6> kArmJoints{"shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint",
                                                "wrist_1_joint",      "wrist_2_joint",       "wrist_3_joint"};

}  // namespace

TelemetryLoop::TelemetryLoop(Edges& edges, DdsPublisher publisher, EmbodimentMapping hand,
                             const hand::GloveLayout& glove, const robot::UrGeometry& arm)
    : edges_(edges), publisher_(std::move(publisher)), hand_(std::move(hand)), markers_(glove), arm_(arm) {
  joint_names_.assign(kArmJoints.begin(), kArmJoints.end());
  joint_names_.insert(joint_names_.end(), hand_.urdf_joint_names().begin(), hand_.urdf_joint_names().end());
}

void TelemetryLoop::run() {
  constexpr auto kPeriod = std::chrono::milliseconds(20);
  TimePoint t_next = transport::now();
  while (!edges_.stop.load(kRelaxed)) {
    t_next = std::max(t_next + kPeriod, transport::now());
    std::this_thread::sleep_until(t_next);
    take();
    measure_errors();
    measure_rates(transport::now());
    log_mode();
    log_hand_hold();
    log_hand_condition();
    publish(transport::now());
    const std::lock_guard lock(mutex_);
    shared_ = data_;
  }
}

TelemetrySnapshot TelemetryLoop::snapshot() const {
  const std::lock_guard lock(mutex_);
  return shared_;
}

void TelemetryLoop::take() {
  take_timings();
  new_pose_ = edges_.pose_to_telemetry.update();
  if ((new_fingers_ = edges_.fingers_to_telemetry.update())) {
    fingers_ = edges_.fingers_to_telemetry.get();
    data_.residual_now_m = fingers_.state.residual_m;
    data_.quality = fingers_.state.quality;
    data_.confidence = fingers_.state.confidence;
    data_.hand_confidence = fingers_.state.hand_confidence;
  }
  watch_markers(transport::now());
  if ((new_arm_ = edges_.arm_to_telemetry.update())) {
    const ArmReport& report = edges_.arm_to_telemetry.get();
    data_.arm = report.state;
    X_BEd_ = report.X_BEd;
  }
  if (edges_.mode_to_telemetry.update()) data_.mode = edges_.mode_to_telemetry.get();
  if (edges_.hand_to_telemetry.update()) {
    hand_report_ = edges_.hand_to_telemetry.get();
    data_.hand = hand_report_.state;
    data_.hand_action = hand_report_.command.action;
    data_.hand_hold = hand_report_.hold;
    data_.kept_joints = hand_report_.kept_joints;
  }
}

void TelemetryLoop::watch_markers(TimePoint now) {
  markers_.add(fingers_, now);
  if (now - t_markers_ < kMarkersPeriod) return;
  t_markers_ = now;
  data_.markers = markers_.view();
}

void TelemetryLoop::take_timings() {
  ArmTiming arm;
  while (edges_.arm_timings.pop(arm)) {
    latency(Stage::kDecode).add(arm.t_decoded - arm.t_arrival);
    latency(Stage::kHandPose).add(arm.t_estimated - arm.t_decoded);
    latency(Stage::kPhaseWait).add(arm.t_tick - arm.t_estimated);
    latency(Stage::kArm).add(arm.t_computed - arm.t_tick);
    latency(Stage::kWrite).add(arm.t_written - arm.t_computed);
    latency(Stage::kTotal).add(arm.t_written - arm.t_arrival);
  }
  FingerTiming fingers;
  while (edges_.finger_timings.pop(fingers)) {
    latency(Stage::kFingerWait).add(fingers.t_taken - fingers.t_arrival);
    latency(Stage::kFingerSolve).add(fingers.t_solved - fingers.t_taken);
    for (std::size_t i = 0; i < kFingers; ++i) {
      if (fingers.visible_markers[i] == 0) continue;
      residual_sum_m_[i] += fingers.residual_m[i];
      data_.residual_mean_m[i] = residual_sum_m_[i] / static_cast<double>(++residual_count_[i]);
    }
  }
}

void TelemetryLoop::measure_errors() {
  if (!is_moving_mode(data_.mode.mode)) return;
  const Pose X_BE = robot::forward_kinematics(data_.arm.q_rad, arm_);
  data_.arm_error_m = (X_BE.translation() - X_BEd_.translation()).norm();
  data_.arm_error_rad = math::angle_between(X_BE.linear(), X_BEd_.linear());
  double error = 0.0;
  for (std::size_t i = 0; i < std::min(data_.hand.joint_count, fingers_.target.joint_count); ++i) {
    error = std::max(error, std::abs(data_.hand.q_rad[i] - fingers_.target.q_rad[i]));
  }
  data_.hand_error_rad = error;
}

void TelemetryLoop::measure_rates(TimePoint now) {
  const double elapsed_s = to_seconds(now - t_rates_);
  if (elapsed_s < 1.0) return;
  const LoopCounters& counters = edges_.counters;
  const std::array<std::uint64_t, 4> counts{counters.frames_received.load(kRelaxed),
                                            counters.arm_commands.load(kRelaxed), counters.hand_commands.load(kRelaxed),
                                            counters.finger_frames.load(kRelaxed)};
  const std::array<double*, 4> rates{&data_.tracker_hz, &data_.arm_hz, &data_.hand_hz, &data_.fingers_hz};
  if (t_rates_ != TimePoint{}) {
    for (std::size_t i = 0; i < 4; ++i) *rates[i] = static_cast<double>(counts[i] - rate_counts_[i]) / elapsed_s;
  }
  rate_counts_ = counts;
  t_rates_ = now;
}

void TelemetryLoop::log_mode() {
  if (data_.mode.epoch == logged_epoch_) return;
  logged_epoch_ = data_.mode.epoch;
  const std::string cause = safety::to_string(data_.mode.cause);
  const bool fault = data_.mode.mode == safety::Mode::kStopped || data_.mode.mode == safety::Mode::kHolding;
  spdlog::log(fault ? spdlog::level::warn : spdlog::level::info, "mode {}{}{}", safety::to_string(data_.mode.mode),
              cause.empty() ? "" : ": ", cause);
}

/// The hand stands still although the arm moves: say why, once.
void TelemetryLoop::log_hand_hold() {
  const bool unsure = data_.hand_hold == safety::HandHold::kUnsure;
  if (unsure && !unsure_) spdlog::warn("the robot hand holds: {}", safety::to_string(data_.hand_hold));
  if (!unsure && unsure_ && data_.hand_hold == safety::HandHold::kNone) spdlog::info("the robot hand follows again");
  unsure_ = unsure;
}

/// What only a person at the hand can change is said once.
void TelemetryLoop::log_hand_condition() {
  const HandTelemetry& telemetry = data_.hand.telemetry;
  if (std::exchange(logged_condition_, telemetry.condition) == telemetry.condition) return;
  switch (telemetry.condition) {
    case HandCondition::kNotActivated:
    case HandCondition::kRestarted:
    case HandCondition::kFault:
      return spdlog::warn("the robot hand does not move: {}", telemetry.why_not.view());
    case HandCondition::kNoReadings:
      return spdlog::warn("the robot hand moves, but tells no currents or forces");
    default:
      break;
  }
}

void TelemetryLoop::publish(TimePoint now) {
  if (new_arm_ && data_.arm.package > 0) publish_joint_states();
  if (new_pose_) {
    const HandPose& pose = edges_.pose_to_telemetry.get();
    if (pose.valid) publisher_.publish_hand_pose(pose.X_WM, "mocap", to_wall_time(pose.t_capture));
  }
  if (new_fingers_) publisher_.publish_hand_state(fingers_.state);
  if (data_.hand.reply > 0 && data_.hand.reply != published_reply_ && now - t_telemetry_ >= kHandPeriod) {
    publisher_.publish_hand_telemetry(data_.hand, hand_.motor_names());
    published_reply_ = data_.hand.reply;
    t_telemetry_ = now;
  }
  if (data_.markers.frame_number != published_markers_) publish_markers();
  if (now - t_status_ > std::chrono::milliseconds(200)) {
    publish_status();
    t_status_ = now;
  }
  data_.dds_published = publisher_.counters().published;
  data_.dds_failed = publisher_.counters().failed;
}

void TelemetryLoop::publish_joint_states() {
  std::vector<double> q(data_.arm.q_rad.begin(), data_.arm.q_rad.end());
  if (data_.hand.joint_count == hand_.motor_count()) {
    const HandJointAngles angles = hand_.urdf_joint_angles({data_.hand.q_rad.data(), data_.hand.joint_count});
    q.insert(q.end(), angles.q_rad.begin(), angles.q_rad.begin() + static_cast<std::ptrdiff_t>(angles.count));
  }
  const std::span<const std::string> names(joint_names_.data(), q.size());
  publisher_.publish_joint_states(names, q, {}, to_wall_time(data_.arm.t_arrival));
}

void TelemetryLoop::publish_status() {
  const LoopCounters& counters = edges_.counters;
  StatusSample sample;
  sample.stamp = to_wall_time(transport::now());
  sample.mode = safety::to_string(data_.mode.mode);
  sample.cause = safety::to_string(data_.mode.cause);
  sample.epoch = data_.mode.epoch;
  sample.counters = {{"frames_received", counters.frames_received.load(kRelaxed)},
                     {"finger_frames", counters.finger_frames.load(kRelaxed)},
                     {"robot_packages", counters.robot_packages.load(kRelaxed)},
                     {"arm_commands", counters.arm_commands.load(kRelaxed)},
                     {"hand_commands", counters.hand_commands.load(kRelaxed)},
                     {"holds", data_.mode.holds}};
  sample.rates = {
      {"tracker", data_.tracker_hz}, {"arm", data_.arm_hz}, {"hand", data_.hand_hz}, {"fingers", data_.fingers_hz}};
  for (std::size_t i = 0; i < kStageNames.size(); ++i) {
    const Histogram& histogram = data_.latency[i];
    if (histogram.count() == 0) continue;
    sample.latencies.push_back({kStageNames[i], histogram.count(), histogram.quantile_us(0.5),
                                histogram.quantile_us(0.99), histogram.quantile_us(0.999), histogram.max_us()});
  }
  publisher_.publish_status(sample);
}

/// At most as often as the view is made.
void TelemetryLoop::publish_markers() {
  const MarkersView& view = data_.markers;
  published_markers_ = view.frame_number;
  MarkersSample sample{view.frame_number, to_wall_time(view.t_capture), {},
                       view.back.state,   view.back.fit_error_m,        view.findings};
  for (const MarkerRow& row : view.rows) {
    const auto* finger = std::find(kFingerNames.begin(), kFingerNames.end(), row.finger);
    const std::uint8_t index = finger != kFingerNames.end() ? static_cast<std::uint8_t>(finger - kFingerNames.begin())
                               : row.finger == "back"       ? MarkersSample::kBack
                                                            : MarkersSample::kNoFinger;
    sample.markers.push_back({row.label, index, row.seen, static_cast<std::uint8_t>(row.verdict), row.source, row.p_W,
                              row.residual_m.value_or(-1.0)});
  }
  publisher_.publish_markers(sample);
}

}  // namespace embody
