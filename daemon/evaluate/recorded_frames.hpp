#pragma once
// Frames of a recording as the tracker would have delivered them.
#include <string_view>
#include <vector>

#include "core/hand/glove_layout.hpp"
#include "drivers/recording/recording.hpp"

namespace embody::evaluate {

/// Frames of a recording, counted from 1, both ends included.
struct FrameRange {
  std::size_t first{1};
  std::size_t last{0};  ///< 0: the last of the recording
};

/// "A-B" or "A-" (to the end). Error: kInvalidArgument.
[[nodiscard]] Result<FrameRange> parse_frame_range(std::string_view text);

/// Frames in the slots of `layout`. frame_number counts from 1 in the recording; frame k was captured at k / rate after
/// the clock's epoch. Errors: kNotFound (the recording has not all markers of the layout; names them),
/// kInvalidArgument (it has not so many frames), both with the recording's name.
[[nodiscard]] Result<std::vector<MarkerFrame>> marker_frames(const recording::Recording& recording,
                                                             const hand::GloveLayout& layout, const FrameRange& range);

}  // namespace embody::evaluate
