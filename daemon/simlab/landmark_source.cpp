#include "daemon/simlab/landmark_source.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <random>

#include "core/hand/landmark_layout.hpp"
#include "core/hand/synthetic_motion.hpp"
#include "drivers/transport/file.hpp"

namespace embody::sim {
namespace {

using hand::kLandmarkNames;
using hand::kLandmarks;
using landmarks::LandmarkFrame;

constexpr std::size_t kMaxFileBytes = std::size_t{64} << 20;
constexpr std::array<const char*, 4> kSuffixes{"_x_m", "_y_m", "_z_m", "_confidence"};
constexpr std::size_t kConfidence = 3;

/// A number of a landmark that a column holds.
struct Place {
  std::size_t landmark{0};
  std::size_t number{0};  // index into kSuffixes
};

/// Takes the text up to `separator` off the front of `rest`.
std::string_view take(std::string_view& rest, char separator) {
  const std::size_t end = rest.find(separator);
  std::string_view part = rest.substr(0, end);
  rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  if (!part.empty() && part.back() == '\r') part.remove_suffix(1);
  return part;
}

std::optional<Place> place_of(std::string_view column) {
  for (std::size_t i = 0; i < kLandmarks; ++i) {
    for (std::size_t k = 0; k < kSuffixes.size(); ++k) {
      if (column == std::string(kLandmarkNames[i]) + kSuffixes[k]) return Place{i, k};
    }
  }
  return std::nullopt;
}

Result<std::vector<std::optional<Place>>> parse_header(std::string_view line, const std::string& name) {
  std::vector<std::optional<Place>> columns;
  std::array<std::array<int, 4>, kLandmarks> found{};
  while (!line.empty()) {
    const std::string_view column = take(line, ',');
    columns.push_back(place_of(column));
    if (columns.back() && found[columns.back()->landmark][columns.back()->number]++ > 0) {
      return make_error(Errc::kMalformed, "%.80s:1: two columns are named %.*s", name.c_str(),
                        static_cast<int>(std::min<std::size_t>(column.size(), 40)), column.data());
    }
  }
  for (std::size_t i = 0; i < kLandmarks; ++i) {
    for (std::size_t k = 0; k < kConfidence; ++k) {
      if (found[i][k] == 1) continue;
      return make_error(Errc::kMalformed, "%.80s:1: there is no column %s%s", name.c_str(), kLandmarkNames[i],
                        kSuffixes[k]);
    }
  }
  return columns;
}

/// A finite number, NaN for an empty cell or nan; nothing for other text.
std::optional<float> parse_number(std::string_view cell) {
  while (!cell.empty() && cell.front() == ' ') cell.remove_prefix(1);
  while (!cell.empty() && cell.back() == ' ') cell.remove_suffix(1);
  if (cell.empty()) return std::nanf("");
  float value = 0.0F;
  const auto [end, problem] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (problem != std::errc{} || end != cell.data() + cell.size() || std::isinf(value)) return std::nullopt;
  return value;
}

/// One row; the error is only its end: "in column 3 ...".
Result<LandmarkFrame> parse_row(std::string_view line, const std::vector<std::optional<Place>>& columns) {
  LandmarkFrame frame;
  for (auto& landmark : frame.landmarks) landmark.confidence = 1.0F;
  const auto cells = static_cast<std::size_t>(std::count(line.begin(), line.end(), ',')) + 1;
  if (cells != columns.size()) {
    return make_error(Errc::kMalformed, "%zu columns, the header has %zu", cells, columns.size());
  }
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::string_view cell = take(line, ',');
    if (!columns[i]) continue;
    const std::optional<float> value = parse_number(cell);
    const float most = columns[i]->number == kConfidence ? 1.0F : landmarks::kFarthestMetres;
    if (!value || std::abs(*value) > most || (columns[i]->number == kConfidence && *value < 0.0F)) {
      return make_error(Errc::kMalformed, "column %zu is no number within %g", i + 1, static_cast<double>(most));
    }
    LandmarkFrame::Landmark& landmark = frame.landmarks[columns[i]->landmark];
    (columns[i]->number == kConfidence ? landmark.confidence : landmark.p_W[columns[i]->number]) = *value;
  }
  for (auto& landmark : frame.landmarks) {
    const bool seen = !std::isnan(landmark.p_W[0] + landmark.p_W[1] + landmark.p_W[2] + landmark.confidence);
    if (!seen) landmark = {};
  }
  return frame;
}

}  // namespace

Result<LandmarkRecording> parse_landmarks(std::string_view text, const std::string& name) {
  const auto columns = parse_header(take(text, '\n'), name);
  if (!columns) return columns.error();
  LandmarkRecording recording;
  for (std::size_t line_number = 2; !text.empty(); ++line_number) {
    const std::string_view line = take(text, '\n');
    if (line.empty()) continue;
    const auto frame = parse_row(line, *columns);
    if (!frame) {
      return make_error(Errc::kMalformed, "%.80s:%zu: %s", name.c_str(), line_number, frame.error().detail.c_str());
    }
    recording.push_back(*frame);
  }
  if (recording.empty()) return make_error(Errc::kMalformed, "%.80s:2: there is no frame", name.c_str());
  return recording;
}

Result<LandmarkRecording> load_landmarks(const std::string& path) {
  const auto text = transport::load_text(path, kMaxFileBytes, "a table of hand landmarks (.csv)");
  if (!text) return text.error();
  return parse_landmarks(*text, path);
}

LandmarkRecording make_landmarks(double rate_hz, double duration_s, std::uint64_t seed) {
  constexpr double kNoiseMetres = 0.001;
  constexpr double kOffMetres = 0.02;
  std::mt19937_64 engine(seed);
  const auto uniform = [&engine] { return static_cast<double>(engine() >> 11) * 0x1p-53; };
  const auto noise = [&uniform] {  // nearly normal: sum of four uniform numbers, variance 1/3
    return kNoiseMetres * std::sqrt(3.0) * (uniform() + uniform() + uniform() + uniform() - 2.0);
  };
  const hand::HandModel model;
  const hand::SyntheticMotion motion({rate_hz, duration_s, seed}, model);
  LandmarkRecording recording(motion.frame_count());
  for (std::size_t k = 0; k < recording.size(); ++k) {
    const hand::SyntheticFrame truth = motion.frame(k);
    const auto p_M = hand::landmark_positions(model, truth.q_rad);
    for (std::size_t i = 0; i < kLandmarks; ++i) {
      const Eigen::Vector3d p_W = truth.X_WM * p_M[i] + Eigen::Vector3d(noise(), noise(), noise());
      recording[k].landmarks[i] = {
          {static_cast<float>(p_W.x()), static_cast<float>(p_W.y()), static_cast<float>(p_W.z())}, 0.9F};
    }
    if (engine() % 20 != 0) continue;
    LandmarkFrame::Landmark& unsure = recording[k].landmarks[engine() % kLandmarks];
    unsure.p_W[2] += static_cast<float>(kOffMetres);
    unsure.confidence = 0.05F;
  }
  return recording;
}

}  // namespace embody::sim
