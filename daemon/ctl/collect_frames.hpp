#pragma once
// Some seconds of marker frames from the live tracker, with instructions for the person in front of it.
#include <vector>

#include "core/hal/hand_tracker.hpp"
#include "core/hand/glove_layout.hpp"
#include "daemon/app/signals.hpp"

namespace embody::ctl {

/// Most frames that are kept; of a faster tracker only every second, third ... one.
inline constexpr std::size_t kMostCollected = 20'000;

struct CollectOptions {
  Duration countdown{std::chrono::seconds(3)};
  Duration duration{std::chrono::seconds(10)};
  Duration silence{std::chrono::seconds(5)};  ///< without a frame for this long it gives up
};

struct Collected {
  std::vector<MarkerFrame> frames;
  bool interrupted{false};  ///< Ctrl-C
};

/// Connects, counts down, collects, and says on standard output what to do and how many markers are seen. Errors: those
/// of HandTracker::connect(); kDisconnected, with the tracker's reason; kTimeout.
[[nodiscard]] Result<Collected> collect_frames(HandTracker& tracker, const hand::GloveLayout& layout,
                                               const CollectOptions& options, StopSignals& signals);

}  // namespace embody::ctl
