// Faults of the lab's devices by name: their words are those of the simulators.
#include <algorithm>
#include <sstream>
#include <utility>

#include "daemon/simlab/lab.hpp"
#include "drivers/sim/qtm/studio.hpp"

namespace embody::sim {
namespace {

/// "ur  freeze on" -> "ur", "freeze on".
std::pair<std::string_view, std::string_view> split_command(std::string_view command) {
  const auto trim = [](std::string_view text) {
    text.remove_prefix(std::min(text.size(), text.find_first_not_of(" \t\r")));
    return text;
  };
  command = trim(command);
  const std::size_t end = std::min(command.find_first_of(" \t"), command.size());
  std::string_view words = trim(command.substr(end));
  while (!words.empty() && (words.back() == ' ' || words.back() == '\r')) words.remove_suffix(1);
  return {command.substr(0, end), words};
}

Error unknown_device(std::string_view command, const char* hand) {
  return make_error(Errc::kInvalidArgument, "a fault begins with the device, qtm, ur or %s, not '%.*s'", hand,
                    static_cast<int>(std::min<std::size_t>(command.size(), 40)), command.data());
}

/// `text`: lines of words, two blanks or more, and a meaning.
void append_help(const std::string& device, const std::string& text, std::vector<FaultHelp>& help) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t end = line.find("  ");
    const std::size_t begin = line.find_first_not_of(' ', end);
    if (end == std::string::npos || begin == std::string::npos) continue;
    help.push_back({device, line.substr(0, end), line.substr(begin)});
  }
}

}  // namespace

Status Lab::fault(const std::string& command) {
  const auto [device, words] = split_command(command);
  if (device == "qtm") return qtm_.fault(words);
  if (device == "ur") return ur_.fault(words);
  if (device == hand_->name()) return hand_->fault(words);
  return unknown_device(command, hand_->name());
}

FaultCheck Lab::fault_check() const {
  QtmServerConfig config;
  auto built = Studio::build(config, motion_of(recording_));
  if (!built) return [error = built.error()](std::string_view) { return Status(error); };
  auto studio = std::make_shared<Studio>(std::move(*built));  // a std::function has to be copied
  return [studio, this](std::string_view command) -> Status {
    const auto [device, words] = split_command(command);
    if (device == "qtm") {
      const auto fault = parse_qtm_fault(words);
      if (!fault) return fault.error();
      return Studio::handles(fault->kind) ? studio->act(*fault, TimePoint{}) : Status();
    }
    if (device == "ur") {
      const auto action = parse_ur_fault(words);
      return action ? Status() : Status(action.error());
    }
    return device == hand_->name() ? hand_->check_fault(words) : Status(unknown_device(command, hand_->name()));
  };
}

std::vector<FaultHelp> Lab::fault_help() const {
  std::vector<FaultHelp> help;
  append_help("qtm", sim::fault_help(), help);
  append_help("ur", ur_fault_help(), help);
  append_help(hand_->name(), hand_->fault_help(), help);
  return help;
}

}  // namespace embody::sim
