#include "drivers/sim/robotiq/fault_words.hpp"
#include "drivers/sim/fault_help.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>

namespace embody::sim {
namespace {

using Kind = RobotiqFault::Kind;

enum class Argument : std::uint8_t { kNone, kNumber, kSwitch, kWidth };

struct Grammar {
  std::string_view name;
  Kind kind;
  Argument argument;
  int least, most;
  const char* usage;
  const char* meaning;
};

constexpr std::array<Grammar, 11> kGrammar{{
    {"drop", Kind::kDrop, Argument::kNumber, 0, 1'000'000, "drop N", "the next N answers are not sent"},
    {"garble", Kind::kGarble, Argument::kNumber, 0, 1'000'000, "garble N", "the next N answers are rubbish"},
    {"crc", Kind::kCrc, Argument::kNumber, 0, 1'000'000, "crc N", "the next N answers have a wrong checksum"},
    {"exception", Kind::kException, Argument::kNumber, 0, 1'000'000, "exception N",
     "the next N requests are refused as a device failure"},
    {"mute", Kind::kMute, Argument::kSwitch, 0, 0, "mute on|off", "obeys, but answers nothing"},
    {"unplug", Kind::kUnplug, Argument::kNone, 0, 0, "unplug", "the serial device disappears"},
    {"plug", Kind::kPlug, Argument::kNone, 0, 0, "plug", "and comes back"},
    {"fault", Kind::kFault, Argument::kNumber, 0, 15, "fault CODE",
     "sets gFLT; 10 and above stop the motor; 0 ends it"},
    {"deactivate", Kind::kDeactivate, Argument::kNone, 0, 0, "deactivate", "the power fails for a moment"},
    {"object", Kind::kObject, Argument::kWidth, 0, 200, "object MM|none", "something that wide is between the fingers"},
    {"delay", Kind::kDelay, Argument::kNumber, 0, 10'000, "delay MS", "time from a request to its answer"},
}};

std::string_view next_word(std::string_view& text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  const auto end = std::find_if(text.begin(), text.end(), blank);
  const std::string_view word(text.data(), static_cast<std::size_t>(end - text.begin()));
  text.remove_prefix(word.size());
  return word;
}

std::optional<int> number_in(std::string_view word, int least, int most) {
  int value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size() || value < least || value > most) return std::nullopt;
  return value;
}

bool take_argument(const Grammar& grammar, std::string_view word, RobotiqFault& fault) {
  switch (grammar.argument) {
    case Argument::kNone:
      return word.empty();
    case Argument::kSwitch:
      fault.on = word == "on";
      return word == "on" || word == "off";
    case Argument::kWidth:
      if (word == "none") {
        fault.number = -1;
        return true;
      }
      [[fallthrough]];
    case Argument::kNumber: {
      const auto value = number_in(word, grammar.least, grammar.most);
      fault.number = value.value_or(0);
      return value.has_value();
    }
  }
  return false;
}

}  // namespace

Result<RobotiqFault> parse_robotiq_fault(std::string_view words) {
  const std::string text(words.substr(0, 60));
  const std::string_view name = next_word(words);
  const std::string_view argument = next_word(words);
  const auto* grammar =
      std::find_if(kGrammar.begin(), kGrammar.end(), [name](const Grammar& g) { return g.name == name; });
  if (grammar == kGrammar.end())
    return make_error(Errc::kInvalidArgument, "'%s' is no fault of the gripper; known are: %s", text.c_str(),
                      "drop garble crc exception mute unplug plug fault deactivate object delay");
  RobotiqFault fault;
  fault.kind = grammar->kind;
  if (!take_argument(*grammar, argument, fault) || !next_word(words).empty())
    return make_error(Errc::kInvalidArgument, "'%s' is not understood: say '%s' (%d to %d)", text.c_str(),
                      grammar->usage, grammar->least, grammar->most);
  return fault;
}

std::string robotiq_fault_help() {
  std::string text;
  for (const Grammar& grammar : kGrammar) add_fault_help(text, grammar.usage, grammar.meaning);
  return text;
}

}  // namespace embody::sim
