#pragma once
// A recorded sequence of labelled markers, whatever file it came from.
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/hal/types.hpp"

namespace embody::recording {

/// Most markers of one recording; the limit of the real-time driver (drivers/qualisys/codec.hpp) too.
inline constexpr std::size_t kMaxRecordedMarkers = 256;

/// Frame k was measured at k / rate_hz. `frames[k][i]` belongs to `marker_names[i]`: position in the motion-capture
/// world (m), meaningless unless visible. All frames have marker_names.size() markers.
struct Recording {
  double rate_hz{0.0};
  std::vector<std::string> marker_names;
  std::vector<std::vector<Marker>> frames;
  std::string source;      ///< where it came from, for people
  std::string time_stamp;  ///< date and time of the first frame as its file spells it; may be empty
};

/// Checks that `recording` has every marker of `names`. The error (kNotFound) names all the missing ones and, while
/// there is room, the most similar name that exists.
[[nodiscard]] Status require_markers(const Recording& recording, const std::vector<std::string>& names);

}  // namespace embody::recording
