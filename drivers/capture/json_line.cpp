#include "drivers/capture/json_line.hpp"

namespace embody::capture {

using nlohmann::json;

JsonLine::JsonLine(std::string_view text) {
  std::size_t keys = 0;
  const auto shallow = [&keys](int depth, json::parse_event_t event, json&) {
    if (event == json::parse_event_t::key) ++keys;
    return depth <= 1;  // deeper values are left out, so that nesting costs nothing
  };
  object_ = json::parse(text, shallow, false);
  if (object_.is_discarded() || !object_.is_object()) {
    status_ = make_error(Errc::kMalformed, "this is no JSON object");
  } else if (keys != object_.size()) {
    status_ = make_error(Errc::kMalformed, "a name is there twice, or a value is nested");
  }
}

const json* JsonLine::find(const char* name) {
  if (!status_) return nullptr;
  const auto found = object_.find(name);
  if (found == object_.end()) {
    status_ = make_error(Errc::kMalformed, "\"%s\" is missing", name);
    return nullptr;
  }
  ++taken_;
  return &*found;
}

std::int64_t JsonLine::integer(const char* name, std::int64_t least, std::int64_t most) {
  const json* value = find(name);
  if (value == nullptr) return least;
  // Beyond int64 the number is unsigned and would wrap.
  const bool fits = value->is_number_integer() &&
                    (!value->is_number_unsigned() || value->get<std::uint64_t>() <= static_cast<std::uint64_t>(most));
  if (fits && value->get<std::int64_t>() >= least && value->get<std::int64_t>() <= most) {
    return value->get<std::int64_t>();
  }
  status_ = make_error(Errc::kMalformed, "\"%s\" is not a whole number from %lld to %lld", name,
                       static_cast<long long>(least), static_cast<long long>(most));
  return least;
}

std::string JsonLine::text(const char* name, std::size_t most_bytes) {
  const json* value = find(name);
  if (value == nullptr) return {};
  if (value->is_string() && value->get_ref<const std::string&>().size() <= most_bytes) return value->get<std::string>();
  status_ = make_error(Errc::kMalformed, "\"%s\" is not a text of at most %zu bytes", name, most_bytes);
  return {};
}

std::size_t JsonLine::choice(const char* name, std::span<const char* const> choices) {
  const std::string word = text(name, 40);
  if (!status_) return 0;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (word == choices[i]) return i;
  }
  std::string list;
  for (const char* known : choices) list += (list.empty() ? "" : ", ") + std::string(known);
  status_ = make_error(Errc::kMalformed, "\"%s\" is none of %s", name, list.c_str());
  return 0;
}

void JsonLine::end() {
  if (status_ && taken_ != object_.size()) {
    status_ = make_error(Errc::kMalformed, "there is a name that does not belong here");
  }
}

}  // namespace embody::capture
