#pragma once
// Spellings that the parser and the writer of the TSV dialect share.
#include <string_view>

namespace embody::recording::tsv {

inline constexpr double kMetresPerMillimetre = 1e-3;
/// Coordinates beyond this are no measurement (10 km).
inline constexpr double kMaxCoordinateMm = 1e7;

/// Frame rates outside of 0.001 to 100,000 Hz are no measurement, nor is NaN.
constexpr bool is_rate(double rate_hz) noexcept {
  return rate_hz >= 1e-3 && rate_hz <= 1e5;
}

inline constexpr std::string_view kFrames = "NO_OF_FRAMES";
inline constexpr std::string_view kMarkers = "NO_OF_MARKERS";
inline constexpr std::string_view kFrequency = "FREQUENCY";
inline constexpr std::string_view kTimeStamp = "TIME_STAMP";
inline constexpr std::string_view kMarkerNames = "MARKER_NAMES";
inline constexpr std::string_view kFrameColumn = "Frame";
inline constexpr std::string_view kTimeColumn = "Time";

}  // namespace embody::recording::tsv
