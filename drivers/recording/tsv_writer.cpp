#include <algorithm>
#include <charconv>
#include <cmath>

#include "drivers/recording/tsv_format.hpp"
#include "drivers/recording/tsv_recording.hpp"

namespace embody::recording {
namespace {

constexpr std::string_view kLineEnd = "\r\n";

/// Appends `value` with a decimal point whatever the locale; @pre |value| < 1e15.
void append_fixed(std::string& text, double value, int decimals) {
  char digits[32];
  const auto end = std::to_chars(digits, digits + sizeof digits, value, std::chars_format::fixed, decimals).ptr;
  text.append(digits, end);
}

void append_shortest(std::string& text, double value) {
  char digits[32];
  text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

void append_line(std::string& text, std::string_view key, std::string_view value) {
  text.append(key).append("\t").append(value).append(kLineEnd);
}

bool is_writable_text(std::string_view text) noexcept {
  return std::none_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; });
}

Status check_names(const std::vector<std::string>& names) {
  if (names.empty() || names.size() > kMaxRecordedMarkers) {
    return make_error(Errc::kInvalidArgument, "cannot write a recording of %zu markers (allowed: 1 to %zu)",
                      names.size(), kMaxRecordedMarkers);
  }
  for (auto name = names.begin(); name != names.end(); ++name) {
    const bool bad = name->empty() || name->front() == ' ' || name->back() == ' ' || !is_writable_text(*name);
    if (!bad && std::find(names.begin(), name, *name) == name) continue;
    return make_error(Errc::kInvalidArgument,
                      "cannot write marker %td: its name is empty, not unique, or has blanks around or tabs inside",
                      name - names.begin() + 1);
  }
  return {};
}

Status check(const Recording& recording) {
  if (auto status = check_names(recording.marker_names); !status) return status;
  if (!tsv::is_rate(recording.rate_hz)) {
    return make_error(Errc::kInvalidArgument, "cannot write a recording at a rate of %g Hz", recording.rate_hz);
  }
  if (!is_writable_text(recording.time_stamp)) {
    return make_error(Errc::kInvalidArgument, "cannot write a time stamp with control characters");
  }
  for (std::size_t k = 0; k < recording.frames.size(); ++k) {
    const auto& markers = recording.frames[k];
    const bool plausible = std::all_of(markers.begin(), markers.end(), [](const Marker& marker) {
      const double largest_m = marker.p_W.cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
      return !marker.visible || largest_m <= tsv::kMaxCoordinateMm * tsv::kMetresPerMillimetre;
    });
    if (plausible && markers.size() == recording.marker_names.size()) continue;
    return make_error(Errc::kInvalidArgument, "cannot write frame %zu: wrong number of markers or no real positions",
                      k);
  }
  return {};
}

void append_header(std::string& text, const Recording& recording) {
  append_line(text, tsv::kFrames, std::to_string(recording.frames.size()));
  append_line(text, "NO_OF_CAMERAS", "0");
  append_line(text, tsv::kMarkers, std::to_string(recording.marker_names.size()));
  std::string rate;
  append_shortest(rate, recording.rate_hz);
  append_line(text, tsv::kFrequency, rate);
  append_line(text, "NO_OF_ANALOG", "0");
  append_line(text, "ANALOG_FREQUENCY", "0");
  append_line(text, "DESCRIPTION", "--");
  if (!recording.time_stamp.empty()) append_line(text, tsv::kTimeStamp, recording.time_stamp);
  append_line(text, "DATA_INCLUDED", "3D");
  std::string columns(tsv::kFrameColumn);
  columns.append("\t").append(tsv::kTimeColumn);
  text += tsv::kMarkerNames;
  for (const auto& name : recording.marker_names) {
    text.append("\t").append(name);
    for (const char axis : {'X', 'Y', 'Z'}) columns.append("\t").append(name).append(" ").push_back(axis);
  }
  text += kLineEnd;
  text += "TRAJECTORY_TYPES";
  for (std::size_t i = 0; i < recording.marker_names.size(); ++i) text += "\tMeasured";
  text.append(kLineEnd).append(columns).append("\t").append(kLineEnd);
}

void append_row(std::string& text, const std::vector<Marker>& markers) {
  for (const auto& marker : markers) {
    for (int axis = 0; axis < 3; ++axis) {
      text += '\t';
      if (marker.visible) {
        append_fixed(text, marker.p_W[axis] / tsv::kMetresPerMillimetre, 3);
      } else {
        text += "nan";
      }
    }
  }
  text += kLineEnd;
}

}  // namespace

Result<std::string> format_tsv(const Recording& recording) {
  if (auto status = check(recording); !status) return status.error();
  std::string text;
  append_header(text, recording);
  text.reserve(text.size() + recording.frames.size() * (16 + 30 * recording.marker_names.size()));
  for (std::size_t k = 0; k < recording.frames.size(); ++k) {
    text.append(std::to_string(k + 1)).append("\t");
    append_fixed(text, static_cast<double>(k) / recording.rate_hz, 5);
    append_row(text, recording.frames[k]);
  }
  return text;
}

}  // namespace embody::recording
