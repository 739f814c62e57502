#include "drivers/ur_rtde/dashboard_reply.hpp"

#include <algorithm>
#include <array>

namespace embody::ur {
namespace {

struct Name {
  std::string_view text;
  int code;
};

constexpr std::array<Name, 10> kRobotModes{{{"NO_CONTROLLER", -1},
                                            {"DISCONNECTED", 0},
                                            {"CONFIRM_SAFETY", 1},
                                            {"BOOTING", 2},
                                            {"POWER_OFF", 3},
                                            {"POWER_ON", 4},
                                            {"IDLE", 5},
                                            {"BACKDRIVE", 6},
                                            {"RUNNING", 7},
                                            {"UPDATING_FIRMWARE", 8}}};

constexpr std::array<Name, 14> kSafetyStatuses{{{"NORMAL", 1},
                                                {"REDUCED", 2},
                                                {"PROTECTIVE_STOP", 3},
                                                {"RECOVERY", 4},
                                                {"SAFEGUARD_STOP", 5},
                                                {"SYSTEM_EMERGENCY_STOP", 6},
                                                {"ROBOT_EMERGENCY_STOP", 7},
                                                {"VIOLATION", 8},
                                                {"FAULT", 9},
                                                {"VALIDATE_JOINT_ID", 10},
                                                {"UNDEFINED_SAFETY_MODE", 11},
                                                {"AUTOMATIC_MODE_SAFEGUARD_STOP", 12},
                                                {"SYSTEM_THREE_POSITION_ENABLING_STOP", 13},
                                                {"TP_THREE_POSITION_ENABLING_STOP", 14}}};

int width(std::string_view text) noexcept {
  return static_cast<int>(std::min<std::size_t>(text.size(), 90));
}

Error not_understood(std::string_view reply) noexcept {
  return make_error(Errc::kMalformed, "the dashboard answers '%.*s', which is not what was asked for", width(reply),
                    reply.data());
}

char lower(char c) noexcept {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

bool starts_with(std::string_view text, std::string_view start) noexcept {
  return text.size() >= start.size() &&
         std::equal(start.begin(), start.end(), text.begin(), [](char a, char b) { return lower(a) == lower(b); });
}

/// What follows "Title: "; empty without a colon.
std::string_view value_of(std::string_view reply) noexcept {
  const std::size_t colon = reply.find(": ");
  return colon == std::string_view::npos ? std::string_view{} : reply.substr(colon + 2);
}

template <std::size_t N>
Result<int> code_of(const std::array<Name, N>& names, std::string_view reply) noexcept {
  const std::string_view value = value_of(reply);
  for (const Name& name : names) {
    if (name.text == value) return name.code;
  }
  return not_understood(reply);
}

}  // namespace

bool take_line(std::string& pending, std::string& line) {
  const std::size_t end = pending.find('\n');
  if (end == std::string::npos) return false;
  line = pending.substr(0, end);
  if (!line.empty() && line.back() == '\r') line.pop_back();
  pending.erase(0, end + 1);
  return true;
}

Result<int> parse_robot_mode(std::string_view reply) noexcept {
  if (!starts_with(reply, "Robotmode: ")) return not_understood(reply);
  return code_of(kRobotModes, reply);
}

Result<int> parse_safety_status(std::string_view reply) noexcept {
  if (!starts_with(reply, "Safetystatus: ") && !starts_with(reply, "Safetymode: ")) return not_understood(reply);
  return code_of(kSafetyStatuses, reply);
}

Result<bool> parse_flag(std::string_view reply) noexcept {
  const std::string_view value = starts_with(reply, "Program running: ") ? value_of(reply) : reply;
  if (value == "true") return true;
  if (value == "false") return false;
  return not_understood(reply);
}

Result<std::string> parse_polyscope_version(std::string_view reply) {
  const std::size_t begin = reply.find(' ');
  const std::size_t end = reply.find(" (", begin == std::string_view::npos ? 0 : begin + 1);
  if (!starts_with(reply, "URSoftware ") || end == std::string_view::npos) return not_understood(reply);
  return std::string(reply.substr(begin + 1, end - begin - 1));
}

Status check_acknowledged(std::string_view command, std::string_view reply, std::string_view expected) noexcept {
  if (starts_with(reply, expected)) return {};
  if (starts_with(reply, "Cannot unlock protective stop until")) {
    return make_error(Errc::kRefused,
                      "a protective stop can be released 5 s after it happened at the earliest: look for its cause, "
                      "then try again");
  }
  if (reply.find("remote control") != std::string_view::npos) {
    return make_error(Errc::kRefused, "the robot is in local control: switch it to Remote Control ('%.*s' refused)",
                      width(command), command.data());
  }
  if (starts_with(reply, "could not understand")) {
    return make_error(Errc::kUnsupported, "the robot's software does not know the dashboard command '%.*s'",
                      width(command), command.data());
  }
  if (starts_with(reply, "Failed to execute") || starts_with(reply, "Cannot")) {
    return make_error(Errc::kRefused,
                      "the robot refuses '%.*s' (%.*s): it has to be in Remote Control, and in a mode that allows it",
                      width(command), command.data(), width(reply), reply.data());
  }
  return not_understood(reply);
}

}  // namespace embody::ur
