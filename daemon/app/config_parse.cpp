// Parsing: the visitor that fills the configuration structs from TOML.
#include <toml++/toml.h>

#include <algorithm>

#include "daemon/app/config_file.hpp"
#include "daemon/app/config_io.hpp"
#include "daemon/app/config_part.hpp"
#include "daemon/app/config_suggest.hpp"
#include "daemon/app/config_values.hpp"

namespace embody::config {
namespace {

namespace fs = std::filesystem;

/// A message with its place, collected so that the first in the file is reported.
struct Problem {
  std::string where;  // FILE:LINE
  std::string text;
};

/// One file being read.
struct Source {
  std::string name;  // for messages
  fs::path folder;
  bool included{false};
};

/// What all readers of one load share.
struct Load {
  std::vector<Problem> problems;
  std::vector<std::string> files;
  Errc code{Errc::kMalformed};
};

std::string place(const Source& source, const toml::source_region& region) {
  return region.begin.line == 0 ? source.name : source.name + ":" + std::to_string(region.begin.line);
}

/// toml++ bounds the nesting of values but not of dotted keys, and recurses into them: a.a.a... can exhaust the stack.
constexpr std::ptrdiff_t kMaxDots = 4096;

/// Parses TOML text. On failure adds a problem with line and column and returns an empty table.
toml::table parse_text(std::string_view text, const Source& source, Load& load) {
  if (std::count(text.begin(), text.end(), '.') > kMaxDots) {
    load.problems.push_back({source.name, "more than 4096 dots: this is no configuration file"});
    return {};
  }
  try {
    return toml::parse(text, std::string_view(source.name));
  } catch (const toml::parse_error& error) {
    const auto begin = error.source().begin;
    load.problems.push_back({source.name + ":" + std::to_string(begin.line) + ":" + std::to_string(begin.column),
                             std::string(error.description())});
    return {};
  }
}

/// An included file may leave the schema number out, but not have another one.
void check_included_schema(const toml::table& table, const Source& inner, Load& load) {
  const toml::node* node = table.get("schema");
  int value = 0;
  if (node == nullptr) return;
  const auto why = read_value(*node, value, Range{kSchema, kSchema}, "");
  if (!why.empty()) load.problems.push_back({place(inner, node->source()), "schema " + why});
}

/// Fills the struct `self` from one table. `table_name` is its name in its own file, for messages.
template <class S>
class Reader {
 public:
  Reader(S& self, const toml::table& table, std::string table_name, const Source& source, Load& load)
      : self_(self), table_(table), table_name_(std::move(table_name)), source_(source), load_(load) {}

  void run() {
    const std::size_t before = load_.problems.size();
    visit(*this, self_);
    if (source_.included && table_name_.empty()) known_.emplace_back("schema");
    report_unknown_keys();
    if constexpr (requires { self_.problem(); }) {
      if (source_.included || load_.problems.size() != before) return;  // complete only with the including table
      if (const std::string why = self_.problem(); !why.empty()) report(table_.source(), why);
    }
  }

  void schema(int& value, const char*) {
    const toml::node* node = find("schema");
    if (node == nullptr) return report({}, "the schema number is missing: start the file with schema = 1");
    const auto why = read_value(*node, value, Range{kSchema, kSchema}, "");
    if (!why.empty()) {
      report(node->source(), "schema " + why + "; this program reads schema " + std::to_string(kSchema));
    }
  }

  template <class T>
  void field(const char* key, T& value, const char*) {
    read(key, value, Range{});
  }
  template <class T>
  void field(const char* key, T& value, Range range, const char*) {
    read(key, value, range);
  }

  template <class E, class Names>
  void choice(const char* key, E& value, const Names& names, const char*) {
    std::string text;
    const toml::node* node = read(key, text, Range{});
    if (node == nullptr) return;
    std::string options;
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (text == names[i]) {
        value = static_cast<E>(i);
        return;
      }
      options += (i == 0 ? "\"" : i + 1 < names.size() ? ", \"" : " or \"") + std::string(names[i]) + "\"";
    }
    report(node->source(), std::string(key) + " must be " + options + ", not \"" + text.substr(0, 40) + "\"");
  }

  void path(const char* key, std::string& value, const char*) {
    std::string text;
    const toml::node* node = read(key, text, Range{});
    if (node == nullptr) return;
    value = text.empty() ? text : locate(key, text, node->source());
  }

  void file_key(const char* fallback, const char*) {
    if (source_.included) {
      if (find("file") != nullptr) report(table_.source(), "an included file cannot include another (key 'file')");
      return;
    }
    std::string text = fallback;
    const toml::node* node = read("file", text, Range{});
    if (!text.empty()) include(text, node == nullptr ? table_.source() : node->source());
  }

  template <class T>
  void list(const char* key, std::vector<T>& items, const char*) {
    const toml::node* node = find(key);
    if (node == nullptr) return;
    const auto* array = node->as_array();
    if (array == nullptr) return report(node->source(), std::string(key) + " " + wanted("a list of tables", *node));
    if (array->size() > kMaxItems) return report(node->source(), std::string(key) + " has too many entries");
    items.assign(array->size(), T{});
    for (std::size_t i = 0; i < items.size(); ++i) read_table(key, (*array)[i], items[i]);
  }

  template <class T>
  void section(const char* key, T& value, const char*) {
    static const toml::table kEmpty;
    const toml::node* node = find(key);
    read_table(key, node == nullptr ? kEmpty : *node, value);
  }

  template <class T>
  void merge(T& value) {
    visit(*this, value);
  }

 private:
  [[nodiscard]] const toml::node* find(const char* key) {
    known_.emplace_back(key);
    return table_.get(key);
  }

  /// Returns the node when the key is there and acceptable.
  template <class T>
  const toml::node* read(const char* key, T& value, Range range) {
    const toml::node* node = find(key);
    if (node == nullptr) return nullptr;
    const auto why = read_value(*node, value, range, unit_of(key));
    if (why.empty()) return node;
    report(node->source(), std::string(key) + " " + why);
    return nullptr;
  }

  template <class T>
  void read_table(const char* key, const toml::node& node, T& value) {
    const auto* table = node.as_table();
    if (table == nullptr) return report(node.source(), std::string(key) + " " + wanted("a table", node));
    Reader<T>(value, *table, table_name_.empty() ? key : table_name_ + "." + key, source_, load_).run();
  }

  void include(const std::string& text, const toml::source_region& region) {
    const std::string found = locate("file", text, region);
    if (found.empty()) return;
    const auto content = read_file(found);
    if (!content) {
      load_.code = content.error().code;
      return report(region, std::string(content.error().detail.view()));
    }
    load_.files.push_back(found);
    const Source inner{found, fs::path(found).parent_path(), true};
    const toml::table table = parse_text(*content, inner, load_);
    check_included_schema(table, inner, load_);
    Reader<S>(self_, table, "", inner, load_).run();
  }

  std::string locate(const char* key, const std::string& text, const toml::source_region& region) {
    const auto found = find_data_file(text, source_.folder);
    if (found) return found->string();
    load_.code = Errc::kNotFound;
    report(region, std::string(key) + ": " + std::string(found.error().detail.view()));
    return {};
  }

  void report_unknown_keys() {
    for (const auto& [key, node] : table_) {
      const std::string_view name = key.str();
      if (std::find(known_.begin(), known_.end(), name) != known_.end()) continue;
      load_.problems.push_back({place(source_, key.source()), "unknown key '" + std::string(name.substr(0, 40)) + "' " +
                                                                  table_text(table_name_) + suggestion(name, known_)});
    }
  }

  void report(const toml::source_region& region, const std::string& text) {
    const std::string table = table_name_.empty() ? "" : "[" + table_name_ + "] ";
    load_.problems.push_back({place(source_, region), table + text});
  }

  S& self_;
  const toml::table& table_;
  std::string table_name_;
  const Source& source_;
  Load& load_;
  std::vector<std::string> known_;
};

/// One sentence: the first problem and how many others there are.
Error to_error(const Load& load) {
  const Problem& first = load.problems.front();
  const std::size_t more = load.problems.size() - 1;
  const std::string rest = more == 0 ? "" : " (and " + std::to_string(more) + " more)";
  return make_error(load.code, "%s: %s%s", shorten_path(first.where).c_str(), first.text.c_str(), rest.c_str());
}

}  // namespace

Result<EmbodyConfig> parse_config(std::string_view text, const std::string& name, const fs::path& folder) {
  if (text.size() > kMaxConfigBytes) {
    return make_error(Errc::kMalformed, "%s: larger than %zu bytes: this is no configuration file",
                      shorten_path(name).c_str(), kMaxConfigBytes);
  }
  Load load;
  const Source source{name, folder, false};
  const toml::table table = parse_text(text, source, load);
  if (!load.problems.empty()) return to_error(load);
  EmbodyConfig config;
  load.files.push_back(name);
  Reader<EmbodyConfig>(config, table, "", source, load).run();
  if (!load.problems.empty()) return to_error(load);
  config.files = std::move(load.files);
  return config;
}

template <class T>
Result<T> load_part(const fs::path& path) {
  const auto content = read_file(path);
  if (!content) return content.error();
  std::error_code ignored;
  Load load;
  const Source source{path.string(), fs::absolute(path, ignored).parent_path(), true};
  const toml::table table = parse_text(*content, source, load);
  check_included_schema(table, source, load);
  T part;
  if (load.problems.empty()) Reader<T>(part, table, "", source, load).run();
  if (load.problems.empty()) {
    if (const std::string why = part.problem(); !why.empty()) load.problems.push_back({source.name, why});
  }
  if (!load.problems.empty()) return to_error(load);
  return part;
}

template Result<SubjectConfig> load_part<SubjectConfig>(const fs::path& path);
template Result<HandConfig> load_part<HandConfig>(const fs::path& path);

}  // namespace embody::config
