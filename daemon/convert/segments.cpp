#include "daemon/convert/segments.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/base/names.hpp"

namespace embody::convert {
namespace {

using nlohmann::json;

/// The end of a long name: that is where files differ.
std::string shown(std::string_view source) {
  constexpr std::size_t kShown = 80;
  return source.size() <= kShown ? std::string(source) : "..." + std::string(source.substr(source.size() - kShown));
}

/// Text of a file, printable and short.
std::string in_quotes(std::string_view text) {
  std::string copy(text.substr(0, 40));
  std::replace_if(
      copy.begin(), copy.end(), [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; }, '?');
  return "'" + copy + "'";
}

std::optional<std::size_t> whole_number(std::string_view text) noexcept {
  std::size_t value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<std::size_t> whole_number(const json& value) {
  if (value.is_number_unsigned()) return value.get<std::size_t>();
  if (value.is_string()) return whole_number(std::string_view(value.get_ref<const std::string&>()));
  return std::nullopt;
}

/// Names of the fields in one of the two formats.
struct Format {
  std::string label;
  std::string start;
  std::string end;
};

class MetadataParser {
 public:
  MetadataParser(std::string_view source, int label_field) : source_(shown(source)) {
    const std::string number = std::to_string(label_field);
    formats_ = {Format{"l" + number, "start_frame", "end_frame"},
                Format{"label " + number, "start index", "end index"}};
  }

  Result<std::vector<Segment>> parse(std::string_view text) const {
    const json root = json::parse(text, nullptr, false);
    if (root.is_discarded()) return at_file("is no JSON");
    if (!root.is_object() || !root.contains("segments") || !root["segments"].is_array()) {
      return at_file("has no list \"segments\"; is this the metadata of a recording?");
    }
    const json& list = root["segments"];
    if (list.empty()) return at_file("lists no segment");
    if (list.size() > kMaxSegments) return at_file("lists more than 100000 segments");
    std::vector<Segment> segments;
    for (const json& item : list) {
      const Result<Segment> segment = parse_one(item, segments.size() + 1);
      if (!segment) return segment.error();
      segments.push_back(*segment);
    }
    return segments;
  }

 private:
  Error at_file(const char* what) const { return make_error(Errc::kMalformed, "%s %s", source_.c_str(), what); }
  Error at_segment(std::size_t number, const std::string& what) const {
    return make_error(Errc::kMalformed, "%s: segment %zu: %s", source_.c_str(), number, what.c_str());
  }

  Result<Segment> parse_one(const json& item, std::size_t number) const {
    if (!item.is_object()) return at_segment(number, "is no object {...}");
    const Format& format = formats_[item.contains(formats_[1].start) ? 1 : 0];
    for (const std::string& field : {format.label, format.start, format.end}) {
      if (!item.contains(field)) return at_segment(number, "field \"" + field + "\" is missing");
    }
    if (!item[format.label].is_string()) return at_segment(number, "field \"" + format.label + "\" is no text");
    const auto start = whole_number(item[format.start]);
    if (!start) return at_segment(number, "field \"" + format.start + "\" is no frame number (0, 1, 2, ...)");
    const auto end = whole_number(item[format.end]);
    if (!end) return at_segment(number, "field \"" + format.end + "\" is no frame number (0, 1, 2, ...)");
    if (*end <= *start) {
      return at_segment(number, "\"" + format.end + "\" " + std::to_string(*end) + " must be greater than \"" +
                                    format.start + "\" " + std::to_string(*start));
    }
    return Segment{item[format.label].get<std::string>(), *start + 1, *end};
  }

  std::string source_;
  std::array<Format, 2> formats_;
};

struct Event {
  std::string name;
  std::size_t frame{0};
  std::size_t line{0};
};

std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> fields;
  while (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  while (true) {
    const auto tab = line.find('\t');
    fields.push_back(line.substr(0, tab));
    if (tab == std::string_view::npos) return fields;
    line.remove_prefix(tab + 1);
  }
}

/// What the header says of events: up to the first row of numbers.
struct EventHeader {
  std::vector<Event> events;
  std::size_t first_frame{1};  ///< number of the first row
};

Result<EventHeader> parse_event_header(std::string_view text, const std::string& source) {
  EventHeader header;
  bool frame_column = false;
  for (std::size_t line_number = 1; !text.empty(); ++line_number) {
    const auto end = text.find('\n');
    const auto fields = fields_of(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (fields[0] == "EVENT") {
      const auto frame = fields.size() > 2 ? whole_number(fields[2]) : std::nullopt;
      if (!frame) {
        return make_error(Errc::kMalformed, "%s:%zu: EVENT %s has no frame number", source.c_str(), line_number,
                          fields.size() > 1 ? in_quotes(fields[1]).c_str() : "");
      }
      header.events.push_back({std::string(fields[1]), *frame, line_number});
    }
    if (fields[0] == "Frame") {
      frame_column = true;
    } else if (frame_column || whole_number(fields[0])) {
      if (frame_column) header.first_frame = whole_number(fields[0]).value_or(1);
      break;
    }
  }
  return header;
}

}  // namespace

Result<std::vector<Segment>> parse_segments(std::string_view json, std::string_view source, int label_field) {
  return MetadataParser(source, label_field).parse(json);
}

Result<std::vector<Segment>> parse_event_segments(std::string_view tsv, std::string_view source) {
  const std::string name = shown(source);
  Result<EventHeader> header = parse_event_header(tsv, name);
  if (!header) return header.error();
  std::vector<Event>& events = header->events;
  if (events.empty()) {
    return make_error(Errc::kNotFound, "%s has no EVENT lines; mark events in QTM and export them in the header",
                      name.c_str());
  }
  std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) { return a.frame < b.frame; });
  if (events.size() % 2 != 0) {
    return make_error(Errc::kMalformed, "%s:%zu: event %s has no partner: each segment is a pair of events",
                      name.c_str(), events.back().line, in_quotes(events.back().name).c_str());
  }
  std::vector<Segment> segments;
  for (std::size_t i = 0; i < events.size(); i += 2) {
    if (events[i].frame < header->first_frame) {
      return make_error(Errc::kMalformed, "%s:%zu: event %s is at frame %zu, before the first one, %zu", name.c_str(),
                        events[i].line, in_quotes(events[i].name).c_str(), events[i].frame, header->first_frame);
    }
    const std::size_t before = header->first_frame - 1;
    segments.push_back({events[i].name, events[i].frame - before, events[i + 1].frame - before});
  }
  return segments;
}

Result<std::vector<Segment>> with_label(const std::vector<Segment>& segments, const std::string& label,
                                        std::string_view source) {
  std::vector<Segment> kept;
  std::vector<std::string> labels;
  for (const Segment& segment : segments) {
    if (segment.label == label) kept.push_back(segment);
    if (std::find(labels.begin(), labels.end(), segment.label) == labels.end()) labels.push_back(segment.label);
  }
  if (!kept.empty()) return kept;
  return make_error(Errc::kNotFound, "%s has no segment %s", shown(source).c_str(),
                    describe_missing({label}, labels, 100).c_str());
}

Status check_segments(const std::vector<Segment>& segments, std::size_t frame_count, std::string_view source) {
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const Segment& segment = segments[i];
    if (segment.first >= 1 && segment.first <= segment.last && segment.last <= frame_count) continue;
    return make_error(
        Errc::kInvalidArgument, "%s: segment %zu %s: there are no frames %zu to %zu, the recording has %zu",
        shown(source).c_str(), i + 1, in_quotes(segment.label).c_str(), segment.first, segment.last, frame_count);
  }
  return {};
}

}  // namespace embody::convert
