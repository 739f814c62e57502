#pragma once
// What the simulated cameras see: a recording, or a function that makes it up.
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/hal/types.hpp"
#include "drivers/recording/recording.hpp"

namespace embody::sim {

/// Writes frame `frame` (counted from 0) into `markers`, one per marker name. Called in any order, from the server's
/// thread and under its lock: it must not call the server.
using MotionGenerator = std::function<void(std::size_t frame, std::span<Marker> markers)>;

struct Motion {
  double rate_hz{0.0};  ///< up to kMaxRate_hz
  std::vector<std::string> marker_names;
  std::optional<std::size_t> frames;  ///< nothing: without end
  MotionGenerator generate;
  std::string source;  ///< where it comes from, for people

  static constexpr double kMaxRate_hz = 10'000.0;
  static constexpr std::size_t kMaxMarkers = recording::kMaxRecordedMarkers;

  [[nodiscard]] std::vector<Marker> frame(std::size_t index) const {
    std::vector<Marker> markers(marker_names.size());
    generate(index, markers);
    return markers;
  }
};

/// The motion of a recording, which it takes along. A recording that does not hold together yields a motion that
/// check_motion() refuses.
[[nodiscard]] Motion motion_of(recording::Recording recording);

/// Error kInvalidArgument: no rate, frames, markers or generator, or too much of them; marker names that repeat.
[[nodiscard]] Status check_motion(const Motion& motion);

}  // namespace embody::sim
