#pragma once
// What trackers do to finger markers, done to recordings on purpose. Frames from `first` on, `count` of them or up to
// the end; slots of paper_glove().
#include <vector>

#include "core/hand/glove_layout.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::test {

using Frames = std::vector<MarkerFrame>;

/// The real recording with capture times (100 Hz); empty when it is not here.
[[nodiscard]] Frames real_frames();
/// The synthetic motion at 100 Hz, without its own gaps.
[[nodiscard]] Frames synthetic_frames(double duration_s);

/// The two labels are exchanged.
void swap_labels(Frames& frames, std::size_t a, std::size_t b, std::size_t first, std::size_t count);
/// The marker is not seen.
void hide(Frames& frames, std::size_t slot, std::size_t first, std::size_t count);
/// The label sits on something fixed in W, `offset_m` from where the marker was in frame `first`.
void put_on_object(Frames& frames, std::size_t slot, const Eigen::Vector3d& offset_m, std::size_t first,
                   std::size_t count);
/// The label sits on something that moves with the hand: its place in the triad's frame is fixed.
void put_on_hand(Frames& frames, std::size_t slot, const Eigen::Vector3d& offset_m, std::size_t first,
                 std::size_t count);

/// Which faults a share of the marker-frames gets.
enum class FaultKind { kDropOut, kSwap, kGhost, kAll };
/// Random faults in runs of 1 to `longest` frames until `rate` (0..1) of the finger-marker-frames are faulty; returns
/// that share. Swaps hit any two finger markers, ghosts jump by 15 to 300 mm.
double make_faults(Frames& frames, FaultKind kind, double rate, std::size_t longest, std::uint64_t seed);

}  // namespace embody::test
