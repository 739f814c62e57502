#include "core/robot/xml_guard.hpp"

#include <algorithm>

namespace embody::robot {
namespace {

constexpr auto kEnd = std::string_view::npos;

bool starts_name(char c) noexcept {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || static_cast<unsigned char>(c) > 126;
}

std::size_t line_at(std::string_view text, std::size_t position) noexcept {
  return 1U + static_cast<std::size_t>(std::count(text.begin(), text.begin() + static_cast<long>(position), '\n'));
}

/// Position behind the next `closing` at or after `position`, or kEnd.
std::size_t skip_past(std::string_view text, std::size_t position, std::string_view closing) noexcept {
  const std::size_t found = text.find(closing, position);
  return found == kEnd ? kEnd : found + closing.size();
}

/// Position behind the `>` of the start tag at `position`, honouring quoted attribute values, or kEnd.
std::size_t skip_tag(std::string_view text, std::size_t position) noexcept {
  while (position < text.size()) {
    const char c = text[position];
    if (c == '>') return position + 1;
    if (c == '"' || c == '\'') {
      position = text.find(c, position + 1);
      if (position == kEnd) return kEnd;
    }
    ++position;
  }
  return kEnd;
}

}  // namespace

Status check_xml_bounds(std::string_view text, const XmlLimits& limits) noexcept {
  if (text.size() > limits.max_bytes) {
    return make_error(Errc::kUnsupported, "XML: %zu bytes are more than the %zu allowed", text.size(),
                      limits.max_bytes);
  }
  if (text.find('\0') != kEnd) return Error{Errc::kMalformed, "XML: the text contains a NUL byte"};
  std::size_t depth = 0, elements = 0;
  for (std::size_t open = text.find('<'); open != kEnd;) {
    const std::string_view tag = text.substr(open);
    const auto malformed = [&](const char* what) noexcept {
      return make_error(Errc::kMalformed, "XML: %s in line %zu", what, line_at(text, open));
    };
    std::size_t next = kEnd;
    if (tag.starts_with("<!--")) {
      next = skip_past(text, open + 4, "-->");
    } else if (tag.starts_with("<![CDATA[")) {
      next = skip_past(text, open + 9, "]]>");
    } else if (tag.starts_with("<?")) {
      next = skip_past(text, open + 2, ">");
    } else if (tag.starts_with("</")) {
      next = skip_past(text, open + 2, ">");
      if (depth == 0) return malformed("an end tag without a start tag");
      --depth;
    } else if (tag.size() > 1 && starts_name(tag[1])) {
      next = skip_tag(text, open + 1);
      if (++elements > limits.max_elements) {
        return make_error(Errc::kUnsupported, "XML: more than the %zu elements allowed", limits.max_elements);
      }
      if (depth + 1 > limits.max_depth) {
        return make_error(Errc::kUnsupported, "XML: elements are nested more than %zu deep in line %zu",
                          limits.max_depth, line_at(text, open));
      }
      if (next != kEnd && text[next - 2] != '/') ++depth;
    } else {
      return malformed("a stray '<' or a document type");
    }
    if (next == kEnd) return malformed("an unfinished tag or comment");
    open = text.find('<', next);
  }
  if (depth != 0) return Error{Errc::kMalformed, "XML: the text ends before its last end tag"};
  if (elements == 0) return Error{Errc::kMalformed, "XML: the text contains no element"};
  return {};
}

}  // namespace embody::robot
