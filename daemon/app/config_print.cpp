// Printing and documenting: two visitors over the configuration structs.
#include <charconv>
#include <chrono>
#include <type_traits>

#include "daemon/app/config_io.hpp"

namespace embody::config {
namespace {

std::string number_text(double value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  std::string result(text, end);
  if (result.find_first_of(".en") == std::string::npos) result += ".0";
  return result;
}

std::string value_text(double value) {
  return number_text(value);
}
std::string value_text(int value) {
  return std::to_string(value);
}
std::string value_text(bool value) {
  return value ? "true" : "false";
}
template <class Rep, class Period>
std::string value_text(std::chrono::duration<Rep, Period> value) {
  return std::to_string(value.count());
}
std::string value_text(const std::string& value) {
  std::string text = "\"";
  for (const char c : value) {
    if (c == '"' || c == '\\') {
      text += '\\';
      text += c;
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      char escape[8];
      std::snprintf(escape, sizeof escape, "\\u%04X", static_cast<unsigned>(c));
      text += escape;
    } else {
      text += c;
    }
  }
  return text + '"';
}
/// Any sequence: std::array, std::vector, fixed Eigen vectors.
template <class T>
requires requires(const T& sequence) {
  sequence.begin();
}
std::string value_text(const T& sequence) {
  std::string text = "[";
  for (const auto& item : sequence) {
    if (text.size() > 1) text += ", ";
    text += value_text(item);
  }
  return text + "]";
}

std::string join(const std::string& table, const char* key) {
  return table.empty() ? key : table + "." + key;
}

/// Writes the fields of one table; sub-tables follow after them.
class Printer {
 public:
  /// @param included text for a file that a table's key `file` names, and which has no such key itself
  explicit Printer(std::string table, bool included = false) : table_(std::move(table)), included_(included) {}

  void schema(int& value, const char*) { line("schema", value_text(value)); }
  template <class T>
  void field(const char* key, T& value, const char*) {
    line(key, value_text(value));
  }
  template <class T>
  void field(const char* key, T& value, Range, const char*) {
    line(key, value_text(value));
  }
  template <class E, class Names>
  void choice(const char* key, E& value, const Names& names, const char*) {
    line(key, '"' + std::string(names.at(static_cast<std::size_t>(value))) + '"');
  }
  void path(const char* key, std::string& value, const char*) { line(key, value_text(value)); }
  void file_key(const char*, const char*) {
    if (!included_) line("file", "\"\"");
  }
  template <class T>
  void list(const char* key, std::vector<T>& items, const char*) {
    if (items.empty()) return line(key, "[]");
    for (T& item : items) {
      Printer inner(join(table_, key));
      visit(inner, item);
      tables_ += "\n[[" + inner.table_ + "]]\n" + inner.fields_;
    }
  }
  template <class T>
  void section(const char* key, T& value, const char*) {
    Printer inner(join(table_, key));
    visit(inner, value);
    tables_ += "\n[" + inner.table_ + "]\n" + inner.text();
  }
  template <class T>
  void merge(T& value) {
    visit(*this, value);
  }

  [[nodiscard]] std::string text() const { return fields_ + tables_; }

 private:
  void line(const char* key, const std::string& value) { fields_ += std::string(key) + " = " + value + "\n"; }

  std::string table_;
  bool included_{false};
  std::string fields_;
  std::string tables_;
};

template <class T>
const char* type_text() {
  if constexpr (std::is_same_v<T, bool>) return "true or false";
  if constexpr (std::is_same_v<T, std::string>) return "text";
  if constexpr (std::is_same_v<T, std::vector<std::string>>) return "list of texts";
  return "";
}

/// Shortest text of a bound; multiples of pi are written as such.
std::string bound_text(double value) {
  for (const auto& [factor, text] : {std::pair{-2.0, "-2 pi"}, {-1.0, "-pi"}, {1.0, "pi"}, {2.0, "2 pi"}}) {
    if (value == factor * kPi) return text;
  }
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

class Documenter {
 public:
  explicit Documenter(std::string table, std::vector<KeyName>* keys) : table_(std::move(table)), keys_(keys) {}

  void schema(int& value, const char* doc) { row("schema", value_text(value), "this number", doc); }
  template <class T>
  void field(const char* key, T& value, const char* doc) {
    row(key, value_text(value), type_text<T>(), doc);
  }
  template <class T>
  void field(const char* key, T& value, Range range, const char* doc) {
    std::string bounds = bound_text(range.min) + " to " + bound_text(range.max);
    if (const auto unit = unit_of(key); !unit.empty()) bounds += " " + std::string(unit);
    if constexpr (requires { value.begin(); }) {
      const bool fixed = !requires {
        value.push_back(0);
      };
      bounds = (fixed ? std::to_string(value.size()) + " numbers, " : std::string("list of numbers, ")) + bounds;
    } else if constexpr (!std::is_floating_point_v<T>) {
      bounds += bounds.empty() ? "" : ", whole";
    }
    row(key, value_text(value), bounds, doc);
  }
  template <class E, class Names>
  void choice(const char* key, E& value, const Names& names, const char* doc) {
    std::string options;
    for (const char* name : names) options += (options.empty() ? "`\"" : ", `\"") + std::string(name) + "\"`";
    row(key, '"' + std::string(names.at(static_cast<std::size_t>(value))) + '"', options, doc);
  }
  void path(const char* key, std::string& value, const char* doc) { row(key, value_text(value), "file", doc); }
  void file_key(const char* fallback, const char* doc) {
    row("file", '"' + std::string(fallback) + '"', "file, `\"\"` = none", doc);
  }
  template <class T>
  void list(const char* key, std::vector<T>& items, const char* doc) {
    keys_->push_back({table_, key});
    Documenter inner(join(table_, key), keys_);
    T blank;
    visit(inner, blank);
    tables_ += inner.finished("[[" + inner.table_ + "]]",
                              std::string(doc) + " Default: " + std::to_string(items.size()) + " entries.");
  }
  template <class T>
  void section(const char* key, T& value, const char* doc) {
    keys_->push_back({table_, key});
    Documenter inner(join(table_, key), keys_);
    visit(inner, value);
    tables_ += inner.finished("[" + inner.table_ + "]", doc);
  }
  template <class T>
  void merge(T& value) {
    visit(*this, value);
  }

  [[nodiscard]] std::string finished(const std::string& title, const std::string& doc) const {
    std::string text = "\n## `" + title + "`\n\n" + doc + "\n";
    if (!rows_.empty()) text += "\n| key | default | values | meaning |\n|---|---|---|---|\n" + rows_;
    return text + tables_;
  }
  [[nodiscard]] std::string top() const {
    return "\n| key | default | values | meaning |\n|---|---|---|---|\n" + rows_ + tables_;
  }

 private:
  void row(const char* key, const std::string& value, const std::string& values, const char* doc) {
    keys_->push_back({table_, key});
    rows_ += "| `" + std::string(key) + "` | `" + value + "` | " + values + " | " + doc + " |\n";
  }

  std::string table_;
  std::vector<KeyName>* keys_;
  std::string rows_;
  std::string tables_;
};

}  // namespace

std::string_view unit_of(std::string_view key) noexcept {
  constexpr std::array<std::array<std::string_view, 2>, 10> kUnits{{{"_rad_s2", "rad/s2"},
                                                                    {"_rad_s", "rad/s"},
                                                                    {"_m_s", "m/s"},
                                                                    {"_m_rad", "m/rad"},
                                                                    {"_rad", "rad"},
                                                                    {"_ms", "ms"},
                                                                    {"_hz", "Hz"},
                                                                    {"_percent", "%"},
                                                                    {"_m", "m"},
                                                                    {"_s", "s"}}};
  for (const auto& [suffix, unit] : kUnits) {
    if (key.ends_with(suffix)) return unit;
  }
  return {};
}

std::string print_toml(const EmbodyConfig& config) {
  EmbodyConfig copy = config;  // visit() is one function for readers and writers
  Printer printer("");
  copy.visit(printer);
  return printer.text();
}

std::string print_toml(const SubjectConfig& subject) {
  SubjectConfig copy = subject;
  Printer printer("", true);
  copy.visit(printer);
  return "schema = " + std::to_string(kSchema) + "\n" + printer.text();
}

std::string document_config() {
  EmbodyConfig defaults;
  std::vector<KeyName> keys;
  Documenter documenter("", &keys);
  defaults.visit(documenter);
  return "# Configuration\n\n"
         "The daemon reads one TOML file: `--config FILE`, else `$EMBODY_CONFIG`, else `/etc/embody/embody.toml`, else "
         "`../share/embody/embody.toml` beside the program's folder. `embodyd --print-config` prints every value in "
         "force.\n\n"
         "Values are SI and the unit is part of the key. A table with a key `file` takes its values from that TOML "
         "file first and then from its own keys. Files are looked for beside the file that names them, then in "
         "`share/embody`. An unknown key, a wrong type or a value out of range ends the program with exit code 78 and "
         "one sentence that begins with FILE:LINE.\n\n"
         "This page is generated from `daemon/app/config.hpp`; do not edit it.\n" +
         documenter.top();
}

const std::vector<KeyName>& all_keys() {
  static const std::vector<KeyName> keys = [] {
    std::vector<KeyName> list;
    EmbodyConfig defaults;
    Documenter documenter("", &list);
    defaults.visit(documenter);
    return list;
  }();
  return keys;
}

}  // namespace embody::config
