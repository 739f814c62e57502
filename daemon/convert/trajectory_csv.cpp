#include "daemon/convert/trajectory_csv.hpp"

#include "daemon/convert/trajectory_columns.hpp"

namespace embody::convert {
namespace {

constexpr std::size_t kBytesPerNumber = 14;  // most of them

std::string quoted_name(std::string_view source) {
  constexpr std::size_t kShown = 80;
  return source.size() <= kShown ? std::string(source) : "..." + std::string(source.substr(source.size() - kShown));
}

std::vector<std::string> split(std::string_view line, char separator) {
  std::vector<std::string> fields;
  while (true) {
    const auto end = line.find(separator);
    fields.emplace_back(line.substr(0, end));
    if (end == std::string_view::npos) return fields;
    line.remove_prefix(end + 1);
  }
}

class CsvParser {
 public:
  CsvParser(std::string_view text, std::string_view source) : rest_(text), source_(quoted_name(source)) {}

  Result<Trajectory> parse() {
    while (next_line()) {
      Status status;
      if (line_.starts_with('#')) {
        status = comment();
      } else if (names_.empty()) {
        status = columns();
      } else {
        status = row();
      }
      if (!status) return status.error();
    }
    if (names_.empty()) return make_error(Errc::kMalformed, "%s has no line of column names", source_.c_str());
    return std::move(trajectory_);
  }

 private:
  /// The next line that is not empty.
  bool next_line() {
    while (!rest_.empty()) {
      const auto end = rest_.find('\n');
      line_ = rest_.substr(0, end);
      rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
      if (line_.ends_with('\r')) line_.remove_suffix(1);
      ++number_;
      if (!line_.empty()) return true;
    }
    return false;
  }

  Error at_line(const std::string& what) const {
    return make_error(Errc::kMalformed, "%s:%zu: %s", source_.c_str(), number_, what.c_str());
  }

  Status comment() {
    const auto colon = line_.find(": ");
    if (!line_.starts_with("# ") || colon == std::string_view::npos) return {};
    const std::string_view key = line_.substr(2, colon - 2);
    if (set_about(key, line_.substr(colon + 2), trajectory_)) return {};
    return at_line(std::string(key) + " is no number");
  }

  Status columns() {
    separator_ = line_.find('\t') != std::string_view::npos ? '\t' : ',';
    names_ = split(line_, separator_);
    const Status known = set_columns(names_, trajectory_);
    return known ? known : Status(at_line(std::string(known.error().detail.view())));
  }

  Status row() {
    values_.clear();
    for (std::string_view rest = line_; values_.size() < names_.size();) {
      const auto end = rest.find(separator_);
      double value = 0.0;
      if (!parse_number(rest.substr(0, end), value)) {
        return at_line("column '" + names_[values_.size()] + "': '" + std::string(rest.substr(0, end).substr(0, 40)) +
                       "' is no number");
      }
      values_.push_back(value);
      if (end == std::string_view::npos) break;
      rest.remove_prefix(end + 1);
      if (values_.size() == names_.size()) return at_line("more numbers than columns");
    }
    if (values_.size() < names_.size()) return at_line("column '" + names_[values_.size()] + "' is missing");
    append_row(values_, trajectory_);
    return {};
  }

  std::string_view rest_;
  std::string source_;
  std::string_view line_;
  std::size_t number_{0};
  char separator_{','};
  std::vector<std::string> names_;
  std::vector<double> values_;
  Trajectory trajectory_;
};

}  // namespace

std::string format_csv(const Trajectory& trajectory, char separator) {
  std::string text;
  for (const auto& [key, value] : about(trajectory))
    text.append("# ").append(key).append(": ").append(value).append("\n");
  const std::vector<std::string> names = column_names(trajectory);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += separator;
    text += names[i];
  }
  text += '\n';
  text.reserve(text.size() + trajectory.rows.size() * names.size() * kBytesPerNumber);
  std::vector<double> values;
  for (std::size_t row = 0; row < trajectory.rows.size(); ++row) {
    row_values(trajectory, row, values);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (i > 0) text += separator;
      append_number(values[i], "nan", text);
    }
    text += '\n';
  }
  return text;
}

Result<Trajectory> parse_csv(std::string_view text, std::string_view source) {
  return CsvParser(text, source).parse();
}

}  // namespace embody::convert
