#pragma once
// Writing XML as QTM does: CRLF, four blanks of indent, no declaration.
#include <cstdio>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

namespace embody::sim {

[[nodiscard]] inline std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

/// Six decimals, as QTM prints numbers.
[[nodiscard]] inline std::string decimal(double value) {
  char text[64];
  std::snprintf(text, sizeof text, "%.6f", value);
  return text;
}

class XmlText {
 public:
  using Attributes = std::initializer_list<std::pair<const char*, std::string>>;

  void open(const char* name, Attributes attributes = {}) {
    tag(name, attributes, ">");
    ++depth_;
  }
  void close(const char* name) {
    --depth_;
    indent();
    text_ += std::string("</") + name + ">\r\n";
  }
  /// <name>text</name>, also without text.
  void element(const char* name, std::string_view text, Attributes attributes = {}) {
    indent();
    text_ += start(name, attributes) + ">" + escaped(text) + "</" + name + ">\r\n";
  }
  /// <name attributes/>
  void empty(const char* name, Attributes attributes = {}) { tag(name, attributes, "/>"); }

  [[nodiscard]] const std::string& str() const noexcept { return text_; }

 private:
  void indent() { text_.append(4 * depth_, ' '); }
  static std::string start(const char* name, Attributes attributes) {
    std::string tag = std::string("<") + name;
    for (const auto& [key, value] : attributes) tag += std::string(" ") + key + "=\"" + escaped(value) + "\"";
    return tag;
  }
  void tag(const char* name, Attributes attributes, const char* end) {
    indent();
    text_ += start(name, attributes) + end + "\r\n";
  }
  std::string text_;
  std::size_t depth_{0};
};

}  // namespace embody::sim
