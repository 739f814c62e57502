// Faults of the simulated hand by name.
#include <algorithm>
#include <charconv>
#include <limits>

#include "drivers/sim/fault_help.hpp"
#include "drivers/sim/mia/device.hpp"

namespace embody::sim {
namespace {

constexpr unsigned kMaxNumber = 100'000;

struct Words {
  std::array<std::string_view, 4> word{};
  std::size_t count{0};
};

Words split(std::string_view text) noexcept {
  Words words;
  while (words.count < words.word.size()) {
    text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
    if (text.empty()) break;
    const std::size_t end = std::min(text.find(' '), text.size());
    words.word[words.count++] = text.substr(0, end);
    text.remove_prefix(end);
  }
  return words;
}

std::optional<unsigned> number(std::string_view text) noexcept {
  unsigned value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value > kMaxNumber) return std::nullopt;
  return value;
}

std::optional<bool> on_or_off(std::string_view text) noexcept {
  if (text == "on") return true;
  if (text == "off") return false;
  return std::nullopt;
}

constexpr std::array<std::array<const char*, 2>, 18> kHelp{{
    {"unplug", "the serial device disappears"},
    {"plug", "and comes back"},
    {"drop N", "the next N lines are not sent"},
    {"drop_ack N", "the next N acknowledgements are not sent"},
    {"garble N", "the next N lines are rubbish"},
    {"echo_wrong N", "the next N acknowledgements name another command"},
    {"deaf N", "the next N commands are not heard"},
    {"rubbish N", "N bytes of rubbish"},
    {"delay MS", "time from a command to its acknowledgement"},
    {"jitter MS", "up to MS ms more"},
    {"mute on|off", "obeys, but sends nothing"},
    {"half_duplex on|off", "a command before the last one's acknowledgement is dropped"},
    {"undervoltage on|off", "restarts whenever a motor is to move"},
    {"reboot", "restarts: the counters are zero where the fingers are"},
    {"streams off", "no readings by themselves any more"},
    {"stall MOTOR on|off", "thumb, index or mrl does not move"},
    {"contact MOTOR COUNTS", "closing meets an object there"},
    {"contact MOTOR off", "the object is gone"},
}};

Error refuse(std::string_view text) noexcept {
  return make_error(Errc::kInvalidArgument,
                    "mia fault \"%.*s\" is none of: drop|drop_ack|garble|echo_wrong|deaf|rubbish N, delay|jitter MS, "
                    "mute|half_duplex|undervoltage on|off, reboot, streams off, stall MOTOR on|off, "
                    "contact MOTOR COUNTS|off",
                    static_cast<int>(std::min<std::size_t>(text.size(), 40)), text.data());
}

}  // namespace

std::string mia_fault_help() {
  std::string help;
  for (const auto& [words, meaning] : kHelp) add_fault_help(help, words, meaning);
  return help;
}

Status MiaDevice::fault(std::string_view text, TimePoint now) {
  const Words words = split(text);
  const auto& [name, first, second, rest] = words.word;
  if (!rest.empty()) return refuse(text);
  move_to(now);
  if (name == "stall" || name == "contact") {
    const Status done = set_motor_fault(name, first, second);
    return done ? done : refuse(text);
  }
  if (!second.empty()) return refuse(text);
  if (name == "reboot" && first.empty()) return restart(now), Status{};
  if (name == "streams" && first == "off") return streams_.clear(), Status{};
  if (name == "undervoltage" && first.empty()) return faults_.undervoltage = true, Status{};
  if (const auto on = on_or_off(first)) {
    if (name == "mute") return faults_.mute = *on, Status{};
    if (name == "half_duplex") return config_.half_duplex = *on, Status{};
    if (name == "undervoltage") return faults_.undervoltage = *on, Status{};
  }
  if (const auto n = number(first)) {
    if (name == "drop") return faults_.drop = *n, Status{};
    if (name == "drop_ack") return faults_.drop_ack = *n, Status{};
    if (name == "garble") return faults_.garble = *n, Status{};
    if (name == "echo_wrong") return faults_.echo_wrong = *n, Status{};
    if (name == "deaf") return faults_.deaf = *n, Status{};
    if (name == "rubbish") return faults_.rubbish = *n, Status{};
    if (name == "delay") return config_.ack_delay = std::chrono::milliseconds(*n), Status{};
    if (name == "jitter") return config_.ack_jitter = std::chrono::milliseconds(*n), Status{};
  }
  return refuse(text);
}

Status MiaDevice::set_motor_fault(std::string_view name, std::string_view motor, std::string_view value) {
  constexpr std::array<std::string_view, mia::kMotors> kNames{"thumb", "index", "mrl"};
  const Error unknown = make_error(Errc::kInvalidArgument, "unknown");
  for (std::size_t i = 0; i < mia::kMotors; ++i) {
    if (kNames[i] != motor) continue;
    if (name == "stall") {
      const auto on = on_or_off(value);
      if (!on) return unknown;
      body_.motor(i).set_stalled(*on);
      return {};
    }
    const auto counts = number(value);
    if (!counts && value != "off") return unknown;
    body_.motor(i).set_contact(counts ? *counts : std::numeric_limits<double>::infinity());
    return {};
  }
  return unknown;
}

}  // namespace embody::sim
