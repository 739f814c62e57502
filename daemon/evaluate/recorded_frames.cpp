#include "daemon/evaluate/recorded_frames.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace embody::evaluate {
namespace {

bool parse_count(std::string_view text, std::size_t& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() && value > 0;
}

}  // namespace

Result<FrameRange> parse_frame_range(std::string_view text) {
  FrameRange range;
  const std::size_t dash = text.find('-');
  const bool ok = dash != std::string_view::npos && parse_count(text.substr(0, dash), range.first) &&
                  (dash + 1 == text.size() || parse_count(text.substr(dash + 1), range.last)) &&
                  (range.last == 0 || range.first <= range.last);
  if (ok) return range;
  return make_error(Errc::kInvalidArgument,
                    "'%.*s' is no range of frames: give the first and the last one, counted from 1, like 1001-3000",
                    static_cast<int>(std::min<std::size_t>(text.size(), 40)), text.data());
}

Result<std::vector<MarkerFrame>> marker_frames(const recording::Recording& recording, const hand::GloveLayout& layout,
                                               const FrameRange& range) {
  std::vector<std::string> names;
  for (const auto& name : layout.names) names.emplace_back(name.view());
  if (const Status complete = recording::require_markers(recording, names); !complete) return complete.error();
  const std::size_t last = range.last == 0 ? recording.frames.size() : range.last;
  if (last > recording.frames.size() || range.first > last || range.first == 0) {
    return make_error(Errc::kInvalidArgument, "%.120s has %zu frames: there are no frames %zu to %zu",
                      recording.source.c_str(), recording.frames.size(), range.first, last);
  }
  std::vector<std::size_t> columns;
  for (const std::string& name : names) {
    const auto& all = recording.marker_names;
    columns.push_back(static_cast<std::size_t>(std::find(all.begin(), all.end(), name) - all.begin()));
  }
  std::vector<MarkerFrame> frames(last - range.first + 1);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    MarkerFrame& frame = frames[i];
    frame.frame_number = range.first + i;
    frame.t_capture = TimePoint{from_seconds(static_cast<double>(frame.frame_number) / recording.rate_hz)};
    frame.t_arrival = frame.t_capture;
    frame.count = columns.size();
    for (std::size_t slot = 0; slot < columns.size(); ++slot) {
      frame.markers[slot] = recording.frames[frame.frame_number - 1][columns[slot]];
    }
  }
  return frames;
}

}  // namespace embody::evaluate
