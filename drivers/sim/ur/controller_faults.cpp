#include "drivers/sim/ur/controller_faults.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "drivers/sim/fault_help.hpp"
#include "drivers/sim/ur/controller_loop.hpp"
#include "drivers/transport/clock.hpp"

namespace embody::sim {
namespace {

enum class Wants : std::uint8_t { kNothing, kSwitch, kNumber };

struct Argument {
  bool on{false};
  double number{0.0};
  [[nodiscard]] Duration seconds() const noexcept { return from_seconds(number); }
};

struct Fault {
  std::string_view name;
  Wants wants;
  double largest;  // of a number; the least is 0
  void (*apply)(ControllerLoop&, const Argument&);
};

LinkFaults& link(ControllerLoop& loop) {
  return loop.server().shared().link;
}

void set_payload(ControllerLoop& loop, const Argument& argument) {
  rtde::ArmSettings settings = loop.settings();
  settings.payload_kg = argument.number;
  loop.set_settings(settings);
}

constexpr std::array<Fault, 26> kFaults{{
    {"disconnect", Wants::kNothing, 0, [](auto& loop, auto&) { loop.server().disconnect_all(); }},
    {"reset", Wants::kNothing, 0, [](auto& loop, auto&) { loop.server().disconnect_all(true); }},
    {"restart", Wants::kNothing, 0, [](auto& loop, auto&) { loop.restart_rtde(); }},
    {"deaf", Wants::kSwitch, 0, [](auto& loop, auto& a) { loop.faults().deaf = a.on; }},
    {"clock", Wants::kSwitch, 0, [](auto& loop, auto& a) { loop.faults().clock_stands = a.on; }},
    {"jitter", Wants::kNumber, 1000, [](auto& loop, auto& a) { link(loop).jitter = from_seconds(a.number / 1e3); }},
    {"fragment", Wants::kSwitch, 0, [](auto& loop, auto& a) { link(loop).single_bytes = a.on; }},
    {"coalesce", Wants::kNumber, 100,
     [](auto& loop, auto& a) { link(loop).coalesce = static_cast<unsigned>(a.number); }},
    {"texts", Wants::kSwitch, 0, [](auto& loop, auto& a) { loop.server().shared().texts_in_handshake = a.on; }},
    {"in-use", Wants::kNumber, 3600,
     [](auto& loop, auto& a) { loop.server().shared().in_use_until = transport::now() + a.seconds(); }},
    {"occupy", Wants::kSwitch, 0, [](auto& loop, auto& a) { loop.server().occupy_registers(a.on); }},
    {"remote", Wants::kNothing, 0, [](auto& loop, auto&) { loop.set_remote(true); }},
    {"local", Wants::kNothing, 0, [](auto& loop, auto&) { loop.set_remote(false); }},
    {"refuse-upload", Wants::kSwitch, 0, [](auto& loop, auto& a) { loop.faults().refuse_upload = a.on; }},
    {"program", Wants::kSwitch, 0, [](auto& loop, auto& a) { loop.robot().set_program_running(a.on); }},
    {"echo", Wants::kSwitch, 0, [](auto& loop, auto& a) { loop.values().freeze_echo(a.on); }},
    {"protective-stop", Wants::kNothing, 0, [](auto& loop, auto&) { loop.robot().protective_stop(); }},
    {"safeguard", Wants::kSwitch, 0, [](auto& loop, auto& a) { loop.robot().machine().safeguard_stop(a.on); }},
    {"emergency-stop", Wants::kNothing, 0, [](auto& loop, auto&) { loop.robot().emergency_stop(); }},
    {"release-emergency-stop", Wants::kNothing, 0,
     [](auto& loop, auto&) { loop.robot().machine().release_emergency_stop(); }},
    {"violation", Wants::kNothing, 0, [](auto& loop, auto&) { loop.robot().machine().violation(); }},
    {"fault", Wants::kNothing, 0, [](auto& loop, auto&) { loop.robot().machine().fault(); }},
    {"clear-stop", Wants::kNothing, 0, [](auto& loop, auto&) { loop.robot().clear_stop(); }},
    {"power-off", Wants::kNothing, 0, [](auto& loop, auto&) { loop.robot().machine().power_off(); }},
    {"payload", Wants::kNumber, 100, set_payload},
    {"speed", Wants::kNumber, 1, [](auto& loop, auto& a) { loop.robot().machine().set_speed_slider(a.number); }},
}};

// For people. "on" is the fault, "off" the healthy state; but for the program.
constexpr std::array<std::array<const char*, 2>, 27> kHelp{{
    {"disconnect", "closes the RTDE connections"},
    {"reset", "closes them with a TCP reset"},
    {"restart", "RTDE starts again: its clock is zero, recipes are gone"},
    {"freeze on|off|SECONDS", "like a pulled cable; sockets stay open, the robot goes on by itself"},
    {"deaf on|off", "sends packages, takes none"},
    {"clock on|off", "the time stamp stands still"},
    {"jitter MS", "each message is up to MS ms late"},
    {"fragment on|off", "one byte per TCP segment"},
    {"coalesce N", "N messages travel together"},
    {"texts on|off", "text messages in the middle of a handshake"},
    {"in-use SECONDS", "input recipes are refused for so long: another client has them"},
    {"occupy on|off", "another client has the input registers"},
    {"remote", "remote control"},
    {"local", "local control: uploads and dashboard commands are refused"},
    {"refuse-upload on|off", "a control program that is sent does not start"},
    {"program on|off", "off: the control program ends; on: it plays again"},
    {"echo on|off", "the echo of the command in the output registers stands still"},
    {"protective-stop", "as after a collision"},
    {"safeguard on|off", "the safeguard input is open"},
    {"emergency-stop", "the button is pressed"},
    {"release-emergency-stop", "the button is released; the arm stays without power"},
    {"violation", "a safety limit was violated"},
    {"fault", "safety fault of the controller"},
    {"clear-stop", "ends any stop, powers the arm, plays the program"},
    {"power-off", "the arm loses its power"},
    {"payload KG", "the payload of the installation is another"},
    {"speed FRACTION", "speed slider, 0 to 1"},
}};

std::string_view take_word(std::string_view& text) noexcept {
  text.remove_prefix(std::min(text.size(), text.find_first_not_of(' ')));
  const std::string_view word = text.substr(0, text.find(' '));
  text.remove_prefix(word.size());
  return word;
}

std::optional<double> parse_number(std::string_view word, double largest) noexcept {
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  const bool whole = error == std::errc{} && end == word.data() + word.size();
  return whole && value >= 0.0 && value <= largest ? std::optional(value) : std::nullopt;
}

std::optional<Argument> parse_argument(Wants wants, std::string_view word, double largest) noexcept {
  if (wants == Wants::kNothing) return word.empty() ? std::optional(Argument{}) : std::nullopt;
  if (wants == Wants::kSwitch) {
    return word == "on" || word == "off" ? std::optional(Argument{word == "on", 0.0}) : std::nullopt;
  }
  const auto number = parse_number(word, largest);
  return number ? std::optional(Argument{false, *number}) : std::nullopt;
}

/// "freeze" takes both a switch and a number of seconds.
FaultAction freeze(std::string_view word) {
  if (word == "on" || word == "off") return [on = word == "on"](ControllerLoop& loop) { loop.faults().frozen = on; };
  const auto seconds = parse_number(word, 3600.0);
  if (!seconds) return nullptr;
  return [s = *seconds](ControllerLoop& loop) { loop.faults().frozen_until = transport::now() + from_seconds(s); };
}

FaultAction action_of(const Fault& fault, std::string_view word) {
  const auto argument = parse_argument(fault.wants, word, fault.largest);
  if (!argument) return nullptr;
  return [apply = fault.apply, a = *argument](ControllerLoop& loop) { apply(loop, a); };
}

}  // namespace

std::string ur_fault_help() {
  std::string help;
  for (const auto& [words, meaning] : kHelp) add_fault_help(help, words, meaning);
  return help;
}

Result<FaultAction> parse_ur_fault(std::string_view line) {
  std::string words(line.substr(0, 200));
  std::replace(words.begin(), words.end(), '_', '-');
  std::string_view text = words;
  std::string_view name = take_word(text);
  if (name == "ur") name = take_word(text);
  const std::string_view word = take_word(text);
  const auto fault = std::find_if(kFaults.begin(), kFaults.end(), [=](const Fault& f) { return f.name == name; });
  if (fault == kFaults.end() && name != "freeze") {
    return make_error(Errc::kInvalidArgument, "unknown fault '%.*s': %s",
                      static_cast<int>(std::min<std::size_t>(name.size(), 30)), name.data(), kFaultHelp);
  }
  const FaultAction action = name == "freeze" ? freeze(word) : action_of(*fault, word);
  const bool complete = text.find_first_not_of(' ') == std::string_view::npos;
  if (action && complete) return action;
  return make_error(Errc::kInvalidArgument, "'%.*s' does not fit the fault: see %s",
                    static_cast<int>(std::min<std::size_t>(line.size(), 60)), line.data(), kFaultHelp);
}

}  // namespace embody::sim
