#pragma once
// From a recording of markers to trajectories of a robot hand: the daemon's data path, frame by frame, without clocks.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "daemon/app/models.hpp"
#include "daemon/convert/segments.hpp"
#include "daemon/convert/stage_times.hpp"
#include "daemon/convert/trajectory.hpp"
#include "daemon/evaluate/recorded_frames.hpp"
#include "drivers/recording/recording.hpp"

namespace embody::convert {

/// A column of the output with a constant value. The mapping of the other joints does not know of it.
struct FixedJoint {
  std::string name;
  double value{0.0};  ///< rad or m, within the joint's limits
};

struct ConversionOptions {
  std::string hand;                 ///< name of the robot hand, for people
  evaluate::FrameRange range;       ///< frames to convert; used without segments
  std::vector<Segment> segments;    ///< one trajectory for each
  std::optional<double> rate_hz;    ///< rows per second; without: those of the recording
  std::vector<std::string> object;  ///< three markers (object_frame.hpp): poses are relative to their object
  std::vector<FixedJoint> fixed;
  bool filter{false};                    ///< also apply the configuration's filter of the finger angles
  std::function<void(double)> progress;  ///< called now and then with the part that is done, 0..1
};

/// Are the fixed joints joints of this hand, within their limits? Errors: kNotFound, kInvalidArgument.
[[nodiscard]] Status check_fixed(const std::vector<FixedJoint>& fixed, const EmbodimentMapping& mapping);

struct Conversion {
  std::vector<Trajectory> trajectories;  ///< one, or one per segment
  StageTimes times;
  std::size_t frames{0};                 ///< that went through the data path
  std::size_t frames_without_hand{0};    ///< their rows repeat the last known hand and are not valid
  std::size_t frames_without_object{0};  ///< the object's last known pose was used
};

/// One pass of fresh estimators, copies of the models', over the frames. With segments the pass starts at the
/// recording's first frame, so that every segment begins with estimators that have settled, and ends with the last
/// segment; the frames of a trajectory are cut out of it. Motors are interpolated, joints computed from them, so that
/// couplings hold in every row. Rows before the first measured hand (and object) are NaN. Errors: kNotFound (marker or
/// joint), kInvalidArgument (frames, segments, rate, value of a fixed joint).
[[nodiscard]] Result<Conversion> convert(const Models& models, const recording::Recording& recording,
                                         const ConversionOptions& options);

}  // namespace embody::convert
