#pragma once
// Which parts of a recording are movements of their own, and what they are called.
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"

namespace embody::convert {

/// Frames of a recording, counted from 1, both ends included.
struct Segment {
  std::string label;
  std::size_t first{1};
  std::size_t last{1};
};

inline constexpr std::size_t kMaxMetadataBytes = std::size_t{16} << 20;
inline constexpr std::size_t kMaxSegments = 100000;

/// Segments of a metadata file as dfki-ric/hand_embodiment reads them: an object whose list "segments" has objects with
/// "l1" (and "l2"), "start_frame", "end_frame", or, newer, "label 1" (and "label 2"), "start index", "end index". Start
/// and end count from 0 and the end is the first frame after the segment; both are numbers or text with a number.
/// `label_field` is 1 or 2. `source` names the text in errors, which tell segment and field: kMalformed.
[[nodiscard]] Result<std::vector<Segment>> parse_segments(std::string_view json, std::string_view source,
                                                          int label_field = 1);

/// Segments between pairs of header lines `EVENT<tab>name<tab>frame<tab>time` of a motion export: from the first event
/// of a pair to the second, both included, under the first one's name. Events pair up in the order of their frames,
/// which are numbers of the Frame column when there is one, else count from 1. Errors, with source and line:
/// kNotFound (no event), kMalformed (no frame number, one event without a partner).
[[nodiscard]] Result<std::vector<Segment>> parse_event_segments(std::string_view tsv, std::string_view source);

/// Keeps the segments of that label. Error: kNotFound, with the most similar label.
[[nodiscard]] Result<std::vector<Segment>> with_label(const std::vector<Segment>& segments, const std::string& label,
                                                      std::string_view source);

/// Checks that a recording of `frame_count` frames has all of them. Error: kInvalidArgument, which tells the segment.
[[nodiscard]] Status check_segments(const std::vector<Segment>& segments, std::size_t frame_count,
                                    std::string_view source);

}  // namespace embody::convert
