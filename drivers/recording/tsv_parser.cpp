#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "drivers/recording/tsv_format.hpp"
#include "drivers/recording/tsv_recording.hpp"

namespace embody::recording {
namespace {

using Fields = std::vector<std::string_view>;

std::string_view trim(std::string_view text) noexcept {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\r')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\r')) text.remove_suffix(1);
  return text;
}

void split(std::string_view line, Fields& fields) {
  fields.clear();
  while (true) {
    const auto tab = line.find('\t');
    fields.push_back(trim(line.substr(0, tab)));
    if (tab == std::string_view::npos) return;
    line.remove_prefix(tab + 1);
  }
}

/// The file's text in quotes, short and printable.
std::string quoted(std::string_view text) {
  std::string shown(text.substr(0, 40));
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; }, '?');
  return "'" + shown + "'";
}

template <class Number>
bool parse_number(std::string_view text, Number& value) noexcept {
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  return failure == std::errc{} && end == text.data() + text.size();
}

bool equals_ignoring_case(std::string_view a, std::string_view b) noexcept {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](char x, char y) { return lower(x) == lower(y); });
}

bool is_missing(std::string_view field) noexcept {
  return field.empty() || equals_ignoring_case(field, "nan") || equals_ignoring_case(field, "null");
}

bool is_header_key(std::string_view field) noexcept {
  return !field.empty() && std::all_of(field.begin(), field.end(), [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  });
}

std::size_t decimals(std::string_view number) noexcept {
  const auto point = number.find('.');
  return point == std::string_view::npos ? 0 : number.size() - point - 1;
}

class Parser {
 public:
  Parser(std::string_view text, std::string_view source) : rest_(text) {
    if (rest_.starts_with("\xEF\xBB\xBF")) rest_.remove_prefix(3);
    recording_.source = source;
    constexpr std::size_t kShown = 60;
    where_ = source.size() <= kShown ? std::string(source) : "..." + std::string(source.substr(source.size() - kShown));
  }

  Result<Recording> parse() {
    if (auto status = parse_header(); !status) return status.error();
    while (have_line_) {
      if (auto status = parse_row(); !status) return cut_or(status.error());
      next_line();
    }
    if (auto status = check_frames(); !status) return status.error();
    if (auto status = settle_rate(); !status) return status.error();
    return std::move(recording_);
  }

 private:
  /// Advances to the next line that is not blank; `fields_` are its fields.
  void next_line() {
    have_line_ = false;
    while (!rest_.empty() && !have_line_) {
      const auto end = rest_.find('\n');
      terminated_ = end != std::string_view::npos;
      const auto line = rest_.substr(0, end);
      rest_.remove_prefix(terminated_ ? end + 1 : rest_.size());
      ++line_number_;
      split(line, fields_);
      have_line_ = fields_.size() > 1 || !fields_[0].empty();
    }
  }

  Error at_line(Errc code, const std::string& what) const {
    return make_error(code, "%s:%zu: %s", where_.c_str(), line_number_, what.c_str());
  }
  Error at_file(Errc code, const std::string& what) const {
    return make_error(code, "%s: %s", where_.c_str(), what.c_str());
  }
  /// A defect of a last line without line break is most likely the place where a copy was cut.
  Error cut_or(const Error& error) const {
    if (terminated_) return error;
    return make_error(Errc::kTruncated, "%s (the file ends here, without a line break: it is cut; copy it again)",
                      error.detail.c_str());
  }

  bool is_data_line() const {
    double ignored = 0.0;
    return parse_number(fields_[0], ignored) || is_missing(fields_[0]);
  }
  bool is_column_line() const {
    return equals_ignoring_case(fields_[0], tsv::kFrameColumn) || equals_ignoring_case(fields_[0], tsv::kTimeColumn) ||
           fields_[0].ends_with(" X");
  }

  Status parse_header() {
    for (next_line(); have_line_ && !is_data_line() && !is_column_line(); next_line()) {
      if (!is_header_key(fields_[0])) {
        return at_line(Errc::kMalformed, quoted(fields_[0]) +
                                             " is neither a header line, nor column names, nor a number; is this a "
                                             "QTM motion export (.tsv)?");
      }
      if (auto status = parse_header_line(); !status) return status;
    }
    if (recording_.marker_names.empty()) {
      return at_file(Errc::kMalformed,
                     "the header has no MARKER_NAMES line; export 3D data with the TSV header from QTM");
    }
    if (announced_markers_ && *announced_markers_ != recording_.marker_names.size()) {
      return at_file(Errc::kMalformed, "NO_OF_MARKERS says " + std::to_string(*announced_markers_) +
                                           " but MARKER_NAMES lists " + std::to_string(recording_.marker_names.size()) +
                                           "; export again");
    }
    if (have_line_ && is_column_line()) {
      if (auto status = parse_columns(); !status) return status;
      next_line();
    }
    return {};
  }

  Status parse_header_line() {
    const auto key = fields_[0];
    const auto value = fields_.size() > 1 ? fields_[1] : std::string_view{};
    if (key == tsv::kMarkerNames) return parse_names();
    if (key == tsv::kFrames) return parse_count(key, value, announced_frames_);
    if (key == tsv::kMarkers) return parse_count(key, value, announced_markers_);
    if (key == tsv::kTimeStamp && recording_.time_stamp.empty()) recording_.time_stamp = value;
    if (key != tsv::kFrequency || value == "EXT") return {};
    auto& rate_hz = recording_.rate_hz;
    if (parse_number(value, rate_hz) && tsv::is_rate(rate_hz)) return {};
    return at_line(Errc::kMalformed, "FREQUENCY " + quoted(value) + " is not a rate in hertz; correct it");
  }

  Status parse_count(std::string_view key, std::string_view value, std::optional<std::size_t>& count) {
    std::size_t number = 0;
    if (!parse_number(value, number)) {
      return at_line(Errc::kMalformed, std::string(key) + " " + quoted(value) + " is not a count; correct it");
    }
    count = number;
    return {};
  }

  Status parse_names() {
    while (fields_.size() > 1 && fields_.back().empty()) fields_.pop_back();
    if (!recording_.marker_names.empty()) return at_line(Errc::kMalformed, "MARKER_NAMES occurs twice; remove one");
    if (fields_.size() == 1) return at_line(Errc::kMalformed, "MARKER_NAMES lists no marker; label some in QTM");
    if (fields_.size() - 1 > kMaxRecordedMarkers) {
      return at_line(Errc::kUnsupported, "more than " + std::to_string(kMaxRecordedMarkers) + " markers; export fewer");
    }
    auto& names = recording_.marker_names;
    for (std::size_t i = 1; i < fields_.size(); ++i) {
      if (fields_[i].empty()) return at_line(Errc::kMalformed, "marker " + std::to_string(i) + " has no name");
      if (std::find(names.begin(), names.end(), fields_[i]) != names.end()) {
        return at_line(Errc::kMalformed, "two markers are called " + quoted(fields_[i]) + "; rename one");
      }
      names.emplace_back(fields_[i]);
    }
    return {};
  }

  std::string column_name(std::size_t marker_column) const {
    return recording_.marker_names[marker_column / 3] + " " + "XYZ"[marker_column % 3];
  }
  std::size_t column_count() const {
    return std::size_t{frame_column_} + std::size_t{time_column_} + 3 * recording_.marker_names.size();
  }

  /// A trailing tab makes one empty field too many.
  void drop_trailing_field(std::size_t expected) {
    if (fields_.size() == expected + 1 && fields_.back().empty()) fields_.pop_back();
  }

  Status parse_columns() {
    std::size_t i = 0;
    frame_column_ = equals_ignoring_case(fields_[i], tsv::kFrameColumn);
    if (frame_column_) ++i;
    time_column_ = i < fields_.size() && equals_ignoring_case(fields_[i], tsv::kTimeColumn);
    if (time_column_) ++i;
    columns_known_ = true;
    drop_trailing_field(column_count());
    for (std::size_t column = 0; column < 3 * recording_.marker_names.size(); ++column, ++i) {
      const auto expected = column_name(column);
      if (i >= fields_.size()) return at_line(Errc::kMalformed, "column '" + expected + "' is missing; export again");
      if (fields_[i] != expected) {
        return at_line(Errc::kMalformed, "column " + std::to_string(i + 1) + " is " + quoted(fields_[i]) + " where '" +
                                             expected + "' belongs; export again");
      }
    }
    if (i == fields_.size()) return {};
    return at_line(Errc::kMalformed, "column " + quoted(fields_[i]) + " belongs to no marker; export again");
  }

  /// Without a column line the first row tells whether it starts with frame number and time.
  void guess_columns() {
    if (columns_known_) return;
    columns_known_ = true;
    const std::size_t bare = column_count();
    const std::size_t count = fields_.size();
    frame_column_ = time_column_ = count == bare + 2 || (count == bare + 3 && fields_.back().empty());
  }

  Status parse_row() {
    guess_columns();
    const std::size_t expected = column_count();
    drop_trailing_field(expected);
    if (fields_.size() != expected) return wrong_count(expected);
    std::size_t i = 0;
    if (frame_column_) {
      if (auto status = parse_frame_number(fields_[i++]); !status) return status;
    }
    if (time_column_) {
      if (auto status = parse_time(fields_[i++]); !status) return status;
    }
    std::vector<Marker> markers(recording_.marker_names.size());
    for (std::size_t marker = 0; marker < markers.size(); ++marker, i += 3) {
      if (auto status = parse_marker(marker, i, markers[marker]); !status) return status;
    }
    if (!terminated_ && !is_missing(fields_.back()) && decimals(fields_.back()) < decimals(fields_[expected - 2])) {
      return at_line(Errc::kTruncated, "the last number " + quoted(fields_.back()) + " has fewer digits");
    }
    recording_.frames.push_back(std::move(markers));
    return {};
  }

  Error wrong_count(std::size_t expected) const {
    const std::string counts =
        std::to_string(fields_.size()) + " columns where " + std::to_string(expected) + " belong";
    const std::size_t leading = expected - 3 * recording_.marker_names.size();
    if (fields_.size() > expected || fields_.size() < leading) return at_line(Errc::kMalformed, counts);
    return at_line(Errc::kMalformed, counts + ", '" + column_name(fields_.size() - leading) + "' is missing");
  }

  Status parse_frame_number(std::string_view field) {
    std::int64_t number = 0;
    if (!parse_number(field, number)) {
      return at_line(Errc::kMalformed, "column Frame: " + quoted(field) + " is not a frame number");
    }
    if (!recording_.frames.empty() && (last_frame_number_ == INT64_MAX || number != last_frame_number_ + 1)) {
      return at_line(Errc::kMalformed, "frame " + std::to_string(number) + " follows frame " +
                                           std::to_string(last_frame_number_) + "; rows are missing, export again");
    }
    last_frame_number_ = number;
    return {};
  }

  Status parse_time(std::string_view field) {
    double time_s = 0.0;
    if (!parse_number(field, time_s) || !std::isfinite(time_s)) {
      return at_line(Errc::kMalformed, "column Time: " + quoted(field) + " is not a time in seconds");
    }
    if (recording_.frames.empty()) first_time_s_ = time_s;
    last_time_s_ = time_s;
    return {};
  }

  Status parse_marker(std::size_t index, std::size_t first_field, Marker& marker) {
    bool nothing = true;  // each coordinate is missing or zero
    std::optional<std::size_t> gap;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto field = fields_[first_field + axis];
      if (is_missing(field)) {
        gap = axis;
        continue;
      }
      double value_mm = 0.0;
      if (!parse_number(field, value_mm) || !(std::abs(value_mm) <= tsv::kMaxCoordinateMm)) {
        const char* hint = field.find(',') == std::string_view::npos ? "" : " (use the decimal point)";
        return at_line(Errc::kMalformed, "column '" + column_name(3 * index + axis) + "': " + quoted(field) +
                                             " is not a coordinate in millimetres" + hint);
      }
      nothing = nothing && value_mm == 0.0;
      marker.p_W[static_cast<int>(axis)] = value_mm * tsv::kMetresPerMillimetre;
    }
    if (nothing) {
      marker = Marker{};
      return {};
    }
    if (gap) {
      return at_line(Errc::kMalformed, "column '" + column_name(3 * index + *gap) +
                                           "' is empty although the marker's other coordinates are not; export again");
    }
    marker.visible = true;
    return {};
  }

  Status check_frames() const {
    const std::size_t count = recording_.frames.size();
    if (announced_frames_ && count < *announced_frames_) {
      return at_file(Errc::kTruncated, "NO_OF_FRAMES announces " + std::to_string(*announced_frames_) +
                                           " frames, the file ends after " + std::to_string(count) + " (line " +
                                           std::to_string(line_number_) + "); copy or export it again");
    }
    if (announced_frames_ && count > *announced_frames_) {
      return at_file(Errc::kMalformed, "NO_OF_FRAMES announces " + std::to_string(*announced_frames_) +
                                           " frames, the file has " + std::to_string(count) + "; export it again");
    }
    if (count == 0) return at_file(Errc::kMalformed, "there are no frames; export a longer range");
    return {};
  }

  /// Externally clocked recordings have no FREQUENCY: take the rate from the Time column.
  Status settle_rate() {
    if (recording_.rate_hz > 0.0) return {};
    const double span_s = last_time_s_ - first_time_s_;
    const double rate_hz = static_cast<double>(recording_.frames.size() - 1) / span_s;
    if (!time_column_ || !tsv::is_rate(rate_hz)) {
      return at_file(Errc::kMalformed, "neither FREQUENCY nor the Time column tells the rate; add a FREQUENCY line");
    }
    recording_.rate_hz = rate_hz;
    return {};
  }

  std::string_view rest_;
  std::string where_;
  std::size_t line_number_{0};
  Fields fields_;
  bool have_line_{false};
  bool terminated_{true};

  Recording recording_;
  std::optional<std::size_t> announced_frames_;
  std::optional<std::size_t> announced_markers_;
  bool columns_known_{false};
  bool frame_column_{false};
  bool time_column_{false};
  std::int64_t last_frame_number_{0};
  double first_time_s_{0.0};
  double last_time_s_{0.0};
};

}  // namespace

Result<Recording> parse_tsv(std::string_view text, std::string_view source) {
  return Parser(text, source).parse();
}

}  // namespace embody::recording
