#include "drivers/sim/qtm/motion.hpp"

#include <algorithm>
#include <memory>
#include <set>

namespace embody::sim {

Motion motion_of(recording::Recording recording) {
  Motion motion;
  motion.rate_hz = recording.rate_hz;
  motion.marker_names = recording.marker_names;
  motion.source = recording.source;
  const bool whole = std::all_of(recording.frames.begin(), recording.frames.end(),
                                 [&](const auto& frame) { return frame.size() == recording.marker_names.size(); });
  motion.frames = whole ? recording.frames.size() : 0;
  const auto frames = std::make_shared<const std::vector<std::vector<Marker>>>(std::move(recording.frames));
  motion.generate = [frames](std::size_t frame, std::span<Marker> markers) {
    std::copy((*frames)[frame].begin(), (*frames)[frame].end(), markers.begin());
  };
  return motion;
}

Status check_motion(const Motion& motion) {
  const std::size_t markers = motion.marker_names.size();
  const bool sound = markers > 0 && markers <= Motion::kMaxMarkers && motion.generate && motion.frames != 0U &&
                     motion.rate_hz > 0.0 && motion.rate_hz <= Motion::kMaxRate_hz;  // NaN fails too
  if (!sound) {
    return make_error(Errc::kInvalidArgument,
                      "cannot serve '%.80s': it needs a rate of up to %g Hz, frames and 1 to %zu markers",
                      motion.source.c_str(), Motion::kMaxRate_hz, Motion::kMaxMarkers);
  }
  std::set<std::string_view> names;
  for (const auto& name : motion.marker_names) {
    if (names.insert(name).second) continue;
    return make_error(Errc::kInvalidArgument, "cannot serve '%.80s': two markers have the name '%.60s'",
                      motion.source.c_str(), name.c_str());
  }
  return {};
}

}  // namespace embody::sim
