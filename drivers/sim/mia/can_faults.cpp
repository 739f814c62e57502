#include "drivers/sim/mia/can_faults.hpp"
#include "drivers/sim/fault_help.hpp"

#include <array>
#include <charconv>
#include <span>

namespace embody::sim {
namespace {

constexpr std::array<std::string_view, mia::kMotors> kMotorNames{"thumb", "index", "mrl"};

using Help = std::array<const char*, 2>;
constexpr std::array<Help, 5> kBusHelp{{
    {"down", "the bus is gone"},
    {"up", "and comes back"},
    {"bus_off", "the controller reports bus-off"},
    {"error_passive", "the controller reports error-passive"},
    {"no_ack", "the controller reports that nobody acknowledges"},
}};
constexpr std::array<Help, 10> kCompactHelp{{
    {"silent on|off", "obeys, but sends nothing"},
    {"silent MOTOR on|off", "no states of thumb, index or mrl"},
    {"drop_ack N", "the next N acknowledgements are not sent"},
    {"wrong_crc N", "the next N acknowledgements have a wrong checksum"},
    {"garble N", "the next N states are cut"},
    {"drop_state N", "the next N states are not sent"},
    {"counter_stuck on|off", "the counter of the states stands still"},
    {"undervoltage on|off", "the flag of the supply"},
    {"restart", "as after a loss of power"},
    {"calibrate", "positions are known again"},
}};

void append(std::string& help, std::span<const Help> list) {
  for (const auto& [words, meaning] : list) add_fault_help(help, words, meaning);
}

std::optional<bool> on_off(std::string_view word) noexcept {
  if (word == "on") return true;
  if (word == "off") return false;
  return std::nullopt;
}

std::optional<unsigned> number(std::string_view word) noexcept {
  unsigned value = 0;
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (word.empty() || code != std::errc{} || end != word.data() + word.size() || value > 1'000'000) return std::nullopt;
  return value;
}

bool silence_motor(CompactHand& hand, std::string_view words) noexcept {
  for (std::size_t i = 0; i < kMotorNames.size(); ++i) {
    const std::string_view name = kMotorNames[i];
    if (words.substr(0, name.size()) != name || words.size() <= name.size()) continue;
    const auto on = on_off(words.substr(name.size() + 1));
    if (on) hand.silence_motor(i, *on);
    return on.has_value();
  }
  return false;
}

bool count_fault(CompactHand& hand, std::string_view name, unsigned n) noexcept {
  if (name == "drop_ack") {
    hand.drop_acks(n);
  } else if (name == "wrong_crc") {
    hand.break_crc(n);
  } else if (name == "garble") {
    hand.garble_states(n);
  } else if (name == "drop_state") {
    hand.drop_states(n);
  } else {
    return false;
  }
  return true;
}

bool switch_fault(CompactHand& hand, std::string_view name, bool on) noexcept {
  if (name == "silent") {
    hand.silence(on);
  } else if (name == "counter_stuck") {
    hand.stick_counter(on);
  } else if (name == "undervoltage") {
    hand.lower_supply(on);
  } else {
    return false;
  }
  return true;
}

}  // namespace

std::string can_fault_help(bool compact) {
  std::string help;
  append(help, kBusHelp);
  if (compact) append(help, kCompactHelp);
  return help;
}

std::optional<transport::CanErrors> bus_fault(std::string_view text) noexcept {
  transport::CanErrors errors;
  if (text == "bus_off") {
    errors.bus_off = true;
  } else if (text == "error_passive") {
    errors.error_passive = true;
  } else if (text == "no_ack") {
    errors.no_ack = true;
  } else {
    return std::nullopt;
  }
  return errors;
}

Status compact_fault(CompactHand& hand, std::string_view text) {
  const std::size_t blank = text.find(' ');
  const std::string_view name = text.substr(0, blank);
  const std::string_view rest = blank == std::string_view::npos ? std::string_view{} : text.substr(blank + 1);
  if (text == "restart") {
    hand.restart();
    return {};
  }
  if (text == "calibrate") {
    hand.calibrate();
    return {};
  }
  if (const auto n = number(rest); n && count_fault(hand, name, *n)) return {};
  if (const auto on = on_off(rest); on && switch_fault(hand, name, *on)) return {};
  if (name == "silent" && silence_motor(hand, rest)) return {};
  return make_error(Errc::kInvalidArgument,
                    "no fault '%.*s': down, up, bus_off, error_passive, no_ack, silent [thumb|index|mrl] on|off, "
                    "drop_ack N, wrong_crc N, garble N, drop_state N, counter_stuck on|off, undervoltage on|off, "
                    "restart, calibrate",
                    static_cast<int>(std::min<std::size_t>(text.size(), 40)), text.data());
}

}  // namespace embody::sim
