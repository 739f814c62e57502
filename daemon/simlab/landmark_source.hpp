#pragma once
// Hand landmarks to send: from a CSV file, or made from nothing.
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "drivers/landmarks/codec.hpp"

namespace embody::sim {

/// Frames in order; number, time and side are the sender's.
using LandmarkRecording = std::vector<landmarks::LandmarkFrame>;

/// Parses a table with a header line. Columns, in any order: <landmark>_x_m, _y_m and _z_m for each of the 21 names of
/// core/hand/landmark_layout.hpp, and <landmark>_confidence where it is known (else 1); others are passed over. An
/// empty cell or nan is a landmark that was not seen. Errors (kMalformed) start with NAME:LINE.
[[nodiscard]] Result<LandmarkRecording> parse_landmarks(std::string_view text, const std::string& name);

/// Reads such a file, at most 64 MiB. Errors: kNotFound, kMalformed.
[[nodiscard]] Result<LandmarkRecording> load_landmarks(const std::string& path);

/// What a tracker might see of a right hand that reaches, grasps, lifts and places (hand::SyntheticMotion) in the
/// motion-capture world: 1 mm of noise per axis, confidence 0.9, in one of 20 frames one landmark that is hardly seen
/// and 20 mm off.
[[nodiscard]] LandmarkRecording make_landmarks(double rate_hz, double duration_s, std::uint64_t seed);

}  // namespace embody::sim
