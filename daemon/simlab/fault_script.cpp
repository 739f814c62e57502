#include "daemon/simlab/fault_script.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "drivers/transport/file.hpp"

namespace embody::sim {
namespace {

constexpr double kLatest_s = 86'400.0;
constexpr const char* kBlanks = " \t";

Error in_line(const std::string& name, std::size_t line, const char* why) {
  return make_error(Errc::kMalformed, "%.80s:%zu: %s", name.c_str(), line, why);
}

/// Takes the first line; without its end, which may be CR LF.
std::string_view take_line(std::string_view& text) noexcept {
  const std::size_t end = std::min(text.find('\n'), text.size());
  std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

std::string_view trim(std::string_view text) noexcept {
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
  return text.substr(0, text.find_last_not_of(kBlanks) + 1);
}

/// "1.5" or "1.5s".
std::optional<Duration> parse_time(std::string_view word) noexcept {
  if (word.ends_with('s')) word.remove_suffix(1);
  double seconds = 0.0;
  const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), seconds);
  if (failure != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  if (!(seconds >= 0.0 && seconds <= kLatest_s)) return std::nullopt;
  return from_seconds(seconds);
}

/// @pre `line` is trimmed and not empty. The error is only the reason.
Result<ScriptedFault> parse_line(std::string_view line) {
  const auto is_control = [](char c) { return (c >= 0 && c < ' ' && c != '\t') || c == 0x7f; };
  if (std::any_of(line.begin(), line.end(), is_control)) {
    return make_error(Errc::kMalformed, "a control character is in the line");
  }
  const std::string_view when = line.substr(0, line.find_first_of(kBlanks));
  const std::string_view command = trim(line.substr(when.size()));
  ScriptedFault fault;
  const auto at = parse_time(when);
  if (!at) {
    return make_error(Errc::kMalformed,
                      "a line starts with seconds since the start of the playback (0 to 86400), not "
                      "'%.*s'",
                      static_cast<int>(std::min<std::size_t>(when.size(), 40)), when.data());
  }
  if (command.find_first_of(kBlanks) == std::string_view::npos) {
    return make_error(Errc::kMalformed, "after the time come a device and a fault, like 'qtm disconnect'");
  }
  fault.at = *at;
  fault.command = command;
  return fault;
}

}  // namespace

Result<std::vector<ScriptedFault>> parse_script(std::string_view text, const std::string& name,
                                                const std::function<Status(std::string_view)>& check) {
  if (text.size() > kMostScriptBytes) {
    return make_error(Errc::kMalformed, "%.80s: a fault script has at most 64 KiB", name.c_str());
  }
  std::vector<ScriptedFault> script;
  for (std::size_t number = 1; !text.empty(); ++number) {
    if (number > kMostScriptLines) return in_line(name, number, "a fault script has at most 1000 lines");
    const std::string_view line = trim(take_line(text));
    if (line.empty() || line.front() == '#') continue;
    auto fault = parse_line(line);
    if (!fault) return in_line(name, number, fault.error().detail.c_str());
    fault->line = number;
    script.push_back(std::move(*fault));
  }
  std::stable_sort(script.begin(), script.end(), [](const auto& a, const auto& b) { return a.at < b.at; });
  for (const ScriptedFault& fault : script) {
    if (const Status known = check(fault.command); !known) {
      return in_line(name, fault.line, known.error().detail.c_str());
    }
  }
  return script;
}

Result<std::vector<ScriptedFault>> load_script(const std::string& path,
                                               const std::function<Status(std::string_view)>& check) {
  const auto text = transport::load_text(path, kMostScriptBytes, "a fault script");
  if (!text) return text.error();
  return parse_script(*text, path, check);
}

const ScriptedFault* ScriptReader::take(Duration since_play) noexcept {
  if (done_ == faults_.size() || faults_[done_].at > since_play) return nullptr;
  return &faults_[done_++];
}

Duration ScriptReader::next() const noexcept {
  return done_ < faults_.size() ? faults_[done_].at : Duration::max();
}

}  // namespace embody::sim
