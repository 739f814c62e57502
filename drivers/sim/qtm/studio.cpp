#include "drivers/sim/qtm/studio.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace embody::sim {
namespace {

void scale_lengths(FrameData& frame, double factor) {
  for (Marker& marker : frame.markers) marker.p_W *= factor;
  for (UnlabelledMarker& marker : frame.unlabelled) marker.p_W *= factor;
  for (BodyPose& body : frame.bodies) body.X_WB.translation() *= factor;
}

}  // namespace

Result<Studio> Studio::build(const QtmServerConfig& config, Motion motion) {
  if (const Status status = check_motion(motion); !status) return status.error();
  Studio studio(config, std::move(motion));
  if (const Status status = studio.define_bodies(config); !status) return status.error();
  return studio;
}

Studio::Studio(const QtmServerConfig& config, Motion motion)
    : motion_(std::move(motion)),
      loop_(config.loop),
      faults_(motion_),
      measurement_(config.present_as_playback, config.start_on_trigger, config.files, config.calibration_time),
      playback_(motion_.rate_hz) {
  setup_.rate_hz = motion_.rate_hz;
  setup_.axis = config.axis;
  setup_.calibrated = config.calibrated;
  setup_.labels = faults_.labels();
  setup_.start_on_trigger = config.start_on_trigger;
  frame_.camera_time = config.camera_time;
}

Status Studio::define_bodies(const QtmServerConfig& config) {
  std::vector<QtmBody> bodies = config.bodies;
  if (bodies.empty()) {
    QtmBody hand{"hand", {"hand_top", "hand_left", "hand_right"}, BodyFrame::kMarkers};
    if (RigidBody::define(hand, motion_)) bodies.push_back(std::move(hand));
  }
  for (const QtmBody& body : bodies) {
    auto rigid = RigidBody::define(body, motion_);
    if (!rigid) return rigid.error();
    setup_.bodies.push_back(rigid->parameters());
    bodies_.push_back(std::move(*rigid));
  }
  if (!bodies_.empty()) faults_.set_triad(bodies_.front().slots());
  return {};
}

bool Studio::handles(FaultKind kind) noexcept {
  switch (kind) {
    case FaultKind::kResidual:
    case FaultKind::kTimestampReset:
    case FaultKind::kFrozenFrameNumber:
    case FaultKind::kSkip:
    case FaultKind::kRate:
    case FaultKind::kStall:
    case FaultKind::kPause:
    case FaultKind::kCameraLink:
    case FaultKind::kUncalibrated:
    case FaultKind::kAxis:
      return true;
    default:
      return MarkerFaults::handles(kind);
  }
}

Status Studio::act(const Fault& fault, TimePoint now) {
  const auto milliseconds = std::chrono::milliseconds(static_cast<std::int64_t>(fault.value));
  switch (fault.kind) {
    case FaultKind::kResidual:
      frame_.residual_m = 1e-3 * fault.value;
      return {};
    case FaultKind::kTimestampReset:
      playback_.reset_numbers();
      return {};
    case FaultKind::kFrozenFrameNumber:
      frozen_frame_number_ = fault.on;
      return {};
    case FaultKind::kSkip:
      playback_.set_skip(static_cast<std::size_t>(fault.value));
      return {};
    case FaultKind::kRate:
      playback_.set_delivered_rate(fault.value);
      return {};
    case FaultKind::kStall:
      playback_.stall_until(now + milliseconds);
      return {};
    case FaultKind::kPause:
      playback_.pause_until(now + milliseconds);
      return {};
    case FaultKind::kCameraLink:
      frame_.drop_rate_permille = static_cast<std::uint16_t>(fault.value);
      frame_.out_of_sync_permille = static_cast<std::uint16_t>(fault.second_value);
      return {};
    case FaultKind::kUncalibrated:
      setup_.calibrated = !fault.on;
      return {};
    case FaultKind::kAxis:
      setup_.axis = fault.a;
      return {};
    default: {
      const Status status = faults_.act(fault, playback_.tick());
      setup_.labels = faults_.labels();
      return status;
    }
  }
}

Status Studio::check(const std::vector<ScheduledFault>& script) const {
  MarkerFaults trial = faults_;
  for (const ScheduledFault& scheduled : script) {
    if (!MarkerFaults::handles(scheduled.fault.kind)) continue;
    if (const Status status = trial.act(scheduled.fault, scheduled.frame); !status) {
      return make_error(status.error().code, "fault script, line %zu: %s", scheduled.line,
                        status.error().detail.c_str());
    }
  }
  return {};
}

void Studio::start(TimePoint now) {
  playback_.start(now);
  faults_.restart();
  frame_tick_.reset();
}

std::optional<TimePoint> Studio::t_next() const noexcept {
  if (!measurement_.running()) return {};
  return playback_.t_next();
}

Studio::Step Studio::step() {
  const std::size_t tick = playback_.tick();
  std::size_t index = tick;
  if (motion_.frames) {
    if (tick >= *motion_.frames && !loop_) return Step::kEnded;
    index = tick % *motion_.frames;
    if (index == 0) playback_.reset_numbers();
  }
  const bool lost = playback_.lost();
  if (!lost) make_frame(index);
  playback_.advance();
  return lost ? Step::kLost : Step::kFrame;
}

void Studio::make_frame(std::size_t index) {
  const std::size_t tick = playback_.tick();
  const std::size_t number = playback_.number();
  seen_.assign(motion_.marker_names.size(), {});
  motion_.generate(index, seen_);
  faults_.see(tick, seen_);
  faults_.identify(tick, seen_, frame_);
  frame_.bodies.clear();
  for (const RigidBody& body : bodies_) frame_.bodies.push_back(body.pose(seen_));
  scale_lengths(frame_, faults_.scale());
  frame_.timestamp_us = static_cast<std::uint64_t>(std::llround(1e6 * static_cast<double>(number) / motion_.rate_hz));
  frame_.frame_number = frozen_frame_number_ ? 1 : static_cast<std::uint32_t>(number + 1);
  frame_tick_ = tick;
  frame_index_ = index;
}

}  // namespace embody::sim
