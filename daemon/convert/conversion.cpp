#include "daemon/convert/conversion.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/names.hpp"
#include "core/embodiment/arm_target.hpp"
#include "daemon/convert/object_frame.hpp"

namespace embody::convert {
namespace {

using recording::Recording;

/// Columns of the object's three markers in the recording.
using ObjectColumns = std::array<std::size_t, 3>;

Result<std::optional<ObjectColumns>> object_columns(const Recording& recording, const std::vector<std::string>& names) {
  if (names.empty()) return std::optional<ObjectColumns>();
  if (names.size() != 3 || names[0] == names[1] || names[0] == names[2] || names[1] == names[2]) {
    return make_error(Errc::kInvalidArgument, "an object's frame needs three different markers: origin, x axis, plane");
  }
  if (const Status there = recording::require_markers(recording, names); !there) return there.error();
  ObjectColumns columns{};
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto& all = recording.marker_names;
    columns[i] = static_cast<std::size_t>(std::find(all.begin(), all.end(), names[i]) - all.begin());
  }
  return std::optional<ObjectColumns>(columns);
}

/// One run over consecutive frames; makes a trajectory whose columns are the motors.
class Pass {
 public:
  Pass(const Models& models, bool filter, StageTimes& times)
      : pose_(models.hand_pose),
        fingers_(models.fingers),
        filter_(models.filter),
        mapping_(models.embodiment),
        use_filter_(filter),
        times_(times) {}

  /// `object` are its markers; null: poses in the world.
  void step(const MarkerFrame& frame, const std::array<Marker, 3>* object, TrajectoryRow& row,
            double* motors) noexcept {
    const Duration t_start = evaluate::thread_time();
    const HandPose pose = pose_.step(frame);
    if (object != nullptr) see(*object);
    const Duration t_pose = evaluate::thread_time();
    fingers_.step(frame, pose, state_);
    if (use_filter_) filter_.step(state_);
    const Duration t_fingers = evaluate::thread_time();
    mapping_.step(state_, target_);
    const Duration t_embodiment = evaluate::thread_time();
    times_.pose_us.push_back(in_us(t_pose - t_start));
    times_.fingers_us.push_back(in_us(t_fingers - t_pose));
    times_.embodiment_us.push_back(in_us(t_embodiment - t_fingers));

    row.valid = pose.valid && target_.valid;
    known_ = known_ || row.valid;
    if (!row.valid) ++frames_without_hand;
    if (row.valid) X_WP_ = hand_base_target(pose.X_WM, mapping_.X_PM());
    row.valid = row.valid && (object == nullptr || X_WO_.has_value());
    const bool tell = known_ && (object == nullptr || X_WO_.has_value());
    if (tell) set_pose(row, object == nullptr ? X_WP_ : X_WO_->inverse() * X_WP_);
    for (std::size_t m = 0; m < mapping_.motor_count(); ++m) {
      motors[m] = known_ ? target_.q_rad[m] : std::numeric_limits<double>::quiet_NaN();
    }
  }

  std::size_t frames_without_hand{0};
  std::size_t frames_without_object{0};

 private:
  void see(const std::array<Marker, 3>& object) noexcept {
    const std::optional<Pose> X_WO = object_frame(object);
    if (X_WO) X_WO_ = X_WO;
    if (!X_WO) ++frames_without_object;
  }

  hand::PoseEstimator pose_;
  hand::FingerEstimator fingers_;
  hand::HandStateFilter filter_;
  EmbodimentMapping mapping_;
  bool use_filter_;
  StageTimes& times_;
  HandState state_;
  FingerTarget target_;
  std::optional<Pose> X_WO_;
  Pose X_WP_{Pose::Identity()};
  bool known_{false};  // there was a valid frame
};

/// Converts the frames in pieces: whole frames of the tracker are large, and a recording may last for hours.
Result<Trajectory> run(Pass& pass, const Models& models, const Recording& recording, const evaluate::FrameRange& range,
                       const std::optional<ObjectColumns>& object, const ConversionOptions& options) {
  constexpr std::size_t kPiece = 128;
  Trajectory motion;
  motion.source = recording.source;
  motion.hand = options.hand;
  motion.object_markers = options.object;
  motion.first_frame = range.first;
  motion.last_frame = range.last;
  motion.rate_hz = recording.rate_hz;
  for (const std::string& motor : models.embodiment.motor_names()) motion.joints.push_back({motor, false});
  motion.rows.resize(range.last - range.first + 1);
  motion.q.resize(motion.rows.size() * motion.joints.size());
  std::size_t row = 0;
  for (std::size_t first = range.first; first <= range.last; first += kPiece) {
    const auto frames =
        evaluate::marker_frames(recording, models.glove, {first, std::min(first + kPiece - 1, range.last)});
    if (!frames) return frames.error();
    for (const MarkerFrame& frame : *frames) {
      const std::size_t index = frame.frame_number - 1;
      std::array<Marker, 3> markers;
      for (std::size_t m = 0; object && m < 3; ++m) markers[m] = recording.frames[index][(*object)[m]];
      motion.rows[row].time_s = static_cast<double>(index) / recording.rate_hz;
      pass.step(frame, object ? &markers : nullptr, motion.rows[row], motion.joints_of(row));
      ++row;
    }
    if (options.progress) options.progress(static_cast<double>(row) / static_cast<double>(motion.rows.size()));
  }
  make_continuous(motion);
  return motion;
}

/// Values of all moving URDF joints instead of the motors.
Trajectory with_joints(Trajectory motion, const EmbodimentMapping& mapping) {
  const robot::RobotModel& model = mapping.kinematics().model();
  std::vector<JointColumn> joints;
  for (const std::string& name : mapping.urdf_joint_names()) {
    const auto joint = model.find_joint(name);
    joints.push_back({name, joint && model.joints[*joint].type == robot::JointType::kPrismatic});
  }
  const std::size_t motors = motion.joints.size();
  std::vector<double> q;
  q.reserve(motion.rows.size() * joints.size());
  for (std::size_t i = 0; i < motion.rows.size(); ++i) {
    const double* r = motion.joints_of(i);
    const bool known = std::isfinite(r[0]);
    const HandJointAngles angles = mapping.urdf_joint_angles({r, motors});
    for (std::size_t j = 0; j < joints.size(); ++j) {
      q.push_back(known ? angles.q_rad[j] : std::numeric_limits<double>::quiet_NaN());
    }
  }
  motion.joints = std::move(joints);
  motion.q = std::move(q);
  return motion;
}

void fix(Trajectory& motion, const std::vector<FixedJoint>& fixed) {
  for (const FixedJoint& one : fixed) {
    for (std::size_t j = 0; j < motion.joints.size(); ++j) {
      if (motion.joints[j].name != one.name) continue;
      for (std::size_t i = 0; i < motion.rows.size(); ++i) motion.joints_of(i)[j] = one.value;
    }
  }
}

/// Both ends exist.
Result<evaluate::FrameRange> frames_to_convert(const Models& models, const Recording& recording,
                                               const ConversionOptions& options) {
  evaluate::FrameRange range = options.range;
  if (!options.segments.empty()) {
    const Status fit = check_segments(options.segments, recording.frames.size(), recording.source);
    if (!fit) return fit.error();
    const auto last = std::max_element(options.segments.begin(), options.segments.end(),
                                       [](const Segment& a, const Segment& b) { return a.last < b.last; });
    range = {1, last->last};
  }
  if (range.last == 0) range.last = recording.frames.size();
  const bool exist = range.first >= 1 && range.first <= range.last && range.last <= recording.frames.size();
  const auto one = evaluate::marker_frames(recording, models.glove, exist ? evaluate::FrameRange{1, 1} : range);
  if (!one) return one.error();
  return range;
}

}  // namespace

Status check_fixed(const std::vector<FixedJoint>& fixed, const EmbodimentMapping& mapping) {
  const robot::RobotModel& model = mapping.kinematics().model();
  for (const FixedJoint& one : fixed) {
    const auto& names = mapping.urdf_joint_names();
    if (std::find(names.begin(), names.end(), one.name) == names.end()) {
      return make_error(Errc::kNotFound, "the robot hand has no moving joint %s",
                        describe_missing({one.name}, names, 120).c_str());
    }
    const auto joint = model.find_joint(one.name);
    if (!joint) continue;
    const robot::Joint& limits = model.joints[*joint];
    if (one.value >= limits.lower - 1e-9 && one.value <= limits.upper + 1e-9) continue;
    return make_error(Errc::kInvalidArgument, "fixed joint '%.60s' = %g is outside of its limits, %g to %g",
                      one.name.c_str(), one.value, limits.lower, limits.upper);
  }
  return {};
}

Result<Conversion> convert(const Models& models, const Recording& recording, const ConversionOptions& options) {
  if (const Status known = check_fixed(options.fixed, models.embodiment); !known) return known.error();
  const auto object = object_columns(recording, options.object);
  if (!object) return object.error();
  const auto range = frames_to_convert(models, recording, options);
  if (!range) return range.error();

  Conversion conversion;
  conversion.frames = range->last - range->first + 1;
  conversion.times.reserve(conversion.frames);  // none is allocated while time is taken
  Pass pass(models, options.filter, conversion.times);
  const Result<Trajectory> motion = run(pass, models, recording, *range, *object, options);
  if (!motion) return motion.error();
  conversion.frames_without_hand = pass.frames_without_hand;
  conversion.frames_without_object = pass.frames_without_object;

  const auto finish = [&](Trajectory part) -> Status {
    if (options.rate_hz) {
      Result<Trajectory> resampled = resample(part, *options.rate_hz);
      if (!resampled) return resampled.error();
      part = std::move(*resampled);
    }
    part = with_joints(std::move(part), models.embodiment);
    fix(part, options.fixed);
    conversion.trajectories.push_back(std::move(part));
    return {};
  };
  if (options.segments.empty()) {
    if (const Status done = finish(*motion); !done) return done.error();
  }
  for (const Segment& segment : options.segments) {
    Trajectory part = slice(*motion, segment.first - 1, segment.last - 1);
    part.label = segment.label;
    if (const Status done = finish(std::move(part)); !done) return done.error();
  }
  return conversion;
}

}  // namespace embody::convert
