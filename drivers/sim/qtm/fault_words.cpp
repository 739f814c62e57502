#include "drivers/sim/qtm/fault_words.hpp"
#include "drivers/sim/fault_help.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace embody::sim {
namespace {

/// `arguments`: m marker or label, x axis, n number, o on|off; in brackets optional (on|off only: default on).
struct Grammar {
  const char* name;
  FaultKind kind;
  const char* arguments;
  double least{0.0};
  double most{0.0};
  bool whole{true};
  const char* usage;
  const char* meaning;
};

constexpr double kMostFrames = 1e6;
constexpr std::array<Grammar, 34> kGrammar{{
    {"hide", FaultKind::kHide, "m", 0, 0, true, "hide M", "marker M is missing"},
    {"show", FaultKind::kShow, "m", 0, 0, true, "show M", "ends hide, drop, gap, step and ghost of M"},
    {"drop", FaultKind::kDrop, "mn", 1, kMostFrames, true, "drop M N", "marker M is missing for N frames"},
    {"gap", FaultKind::kGap, "mn", 0, kMostFrames, true, "gap M N", "M is missing N frames every 3 s; 0 ends it"},
    {"triad_loss", FaultKind::kTriadLoss, "n", 1, kMostFrames, true, "triad_loss N",
     "the markers of the first body are missing for N frames"},
    {"step", FaultKind::kStep, "mn", -1e3, 1e3, false, "step M MM", "M is displaced by MM mm along x; 0 ends it"},
    {"ghost", FaultKind::kGhost, "mo", 0, 0, true, "ghost M [on|off]", "M is a still reflection 0.1 m above"},
    {"unlabel", FaultKind::kUnlabel, "mn", 1, kMostFrames, true, "unlabel M N",
     "the identification loses M for N frames: it is among the unlabelled"},
    {"nan", FaultKind::kNan, "n", 1, kMostFrames, true, "nan N", "all markers are missing for N frames"},
    {"scale", FaultKind::kScale, "n", 1e-6, 1e6, false, "scale F", "lengths times F (0.001: m instead of mm)"},
    {"residual", FaultKind::kResidual, "n", 0, 1e3, false, "residual MM", "residual of all markers, mm"},
    {"swap", FaultKind::kSwap, "mm", 0, 0, true, "swap A B", "each label follows the other's marker"},
    {"reorder", FaultKind::kReorder, "", 0, 0, true, "reorder", "the label list is reversed, without an event"},
    {"add_label", FaultKind::kAddLabel, "m", 0, 0, true, "add_label L", "a new label, never seen"},
    {"remove_label", FaultKind::kRemoveLabel, "m", 0, 0, true, "remove_label L", "label L is deleted"},
    {"rename_label", FaultKind::kRenameLabel, "mm", 0, 0, true, "rename_label L NEW", "label L gets the name NEW"},
    {"timestamp_reset", FaultKind::kTimestampReset, "", 0, 0, true, "timestamp_reset",
     "time stamps and frame numbers start again"},
    {"frozen_frame_number", FaultKind::kFrozenFrameNumber, "o", 0, 0, true, "frozen_frame_number [on|off]",
     "every frame has number 1"},
    {"skip", FaultKind::kSkip, "n", 0, kMostFrames, true, "skip N", "every N-th frame is lost; 0 ends it"},
    {"rate", FaultKind::kRate, "n", 0, 1e4, false, "rate HZ", "only HZ frames per second arrive; 0 ends it"},
    {"stall", FaultKind::kStall, "n", 1, 6e4, true, "stall MS", "nothing for MS ms, then all of it at once"},
    {"pause", FaultKind::kPause, "n", 1, 6e4, true, "pause MS", "nothing for MS ms; those frames are lost"},
    {"disconnect", FaultKind::kDisconnect, "", 0, 0, true, "disconnect", "closes every connection"},
    {"kill", FaultKind::kKill, "", 0, 0, true, "kill", "closes every connection and all ports"},
    {"restart", FaultKind::kRestart, "", 0, 0, true, "restart", "opens the ports again after kill"},
    {"half_open", FaultKind::kHalfOpen, "o", 0, 0, true, "half_open [on|off]",
     "connections stay open, nothing is sent or answered"},
    {"event_storm", FaultKind::kEventStorm, "o", 0, 0, true, "event_storm [on|off]",
     "20 events before and after each parameter reply"},
    {"event", FaultKind::kEvent, "n", 1, 16, true, "event N", "sends event N once to all"},
    {"camera_link", FaultKind::kCameraLink, "nn", 0, 1000, true, "camera_link DROP SYNC",
     "2D drop and out-of-sync rates, per mille"},
    {"uncalibrated", FaultKind::kUncalibrated, "o", 0, 0, true, "uncalibrated [on|off]",
     "the parameters say: not calibrated"},
    {"axis", FaultKind::kAxis, "x", 0, 0, true, "axis +X..-Z", "the parameters say that this axis is up"},
    {"split_udp", FaultKind::kSplitUdp, "o", 0, 0, true, "split_udp [on|off]", "one datagram per component"},
    {"reorder_udp", FaultKind::kReorderUdp, "o", 0, 0, true, "reorder_udp [on|off]",
     "datagrams arrive pairwise exchanged"},
    {"duplicate_udp", FaultKind::kDuplicateUdp, "o", 0, 0, true, "duplicate_udp [on|off]",
     "every datagram arrives twice"},
}};

/// False when a quotation mark is left open or stands inside a word.
bool split(std::string_view text, std::vector<std::string>& words) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (true) {
    while (!text.empty() && blank(text.front())) text.remove_prefix(1);
    if (text.empty()) return true;
    std::size_t length = 0;
    if (text.front() == '"') {
      const auto end = text.find('"', 1);
      if (end == std::string_view::npos) return false;
      words.emplace_back(text.substr(1, end - 1));
      text.remove_prefix(end + 1);
      if (!text.empty() && !blank(text.front())) return false;
      continue;
    }
    while (length < text.size() && !blank(text[length])) ++length;
    words.emplace_back(text.substr(0, length));
    if (words.back().find('"') != std::string::npos) return false;
    text.remove_prefix(length);
  }
}

bool parse_number(std::string_view text, double& value) noexcept {
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  return failure == std::errc{} && end == text.data() + text.size() && std::isfinite(value);
}

bool is_axis(std::string_view text) noexcept {
  return text.size() == 2 && (text[0] == '+' || text[0] == '-') && text[1] >= 'X' && text[1] <= 'Z';
}

bool is_name(std::string_view text) noexcept {
  constexpr std::size_t kMostCharacters = 100;
  const bool printable = std::none_of(text.begin(), text.end(), [](char c) { return c >= 0 && c < ' '; });
  return !text.empty() && text.size() <= kMostCharacters && printable;
}

/// Takes `word` as an argument of `kind`; false when it is none.
bool take(char kind, const std::string& word, const Grammar& grammar, std::size_t index, Fault& fault) {
  switch (kind) {
    case 'm':
      (index == 0 ? fault.a : fault.b) = word;
      return is_name(word);
    case 'x':
      fault.a = word;
      return is_axis(word);
    case 'o':
      fault.on = word == "on";
      return word == "on" || word == "off";
    default: {
      const bool second = index > 0 && grammar.arguments[index - 1] == 'n';
      double& value = second ? fault.second_value : fault.value;
      if (!parse_number(word, value)) return false;
      return value >= grammar.least && value <= grammar.most && (!grammar.whole || value == std::floor(value));
    }
  }
}

Error wrong_usage(const Grammar& grammar) {
  if (grammar.most > grammar.least) {
    return make_error(Errc::kInvalidArgument, "usage: %s (from %g to %g%s)", grammar.usage, grammar.least, grammar.most,
                      grammar.whole ? ", whole" : "");
  }
  return make_error(Errc::kInvalidArgument, "usage: %s", grammar.usage);
}

/// Frame number or seconds; false when `word` is neither.
bool parse_when(std::string_view word, double rate_hz, std::size_t& frame) {
  constexpr double kLatest = 1e9;
  const bool seconds = word.ends_with('s');
  if (seconds) word.remove_suffix(1);
  double value = 0.0;
  if (!parse_number(word, value) || value < 0.0 || (!seconds && value != std::floor(value))) return false;
  if (seconds) value = std::ceil(value * rate_hz - 1e-6);
  if (!(value <= kLatest)) return false;
  frame = static_cast<std::size_t>(std::max(0.0, value));
  return true;
}

Error in_line(std::size_t line, const char* what) {
  return make_error(Errc::kInvalidArgument, "fault script, line %zu: %s", line, what);
}

}  // namespace

Result<Fault> parse_qtm_fault(std::string_view text) {
  std::vector<std::string> words;
  if (!split(text, words)) return make_error(Errc::kInvalidArgument, "a quotation mark is out of place");
  if (words.empty()) return make_error(Errc::kInvalidArgument, "a fault needs a name");
  const auto* grammar =
      std::find_if(kGrammar.begin(), kGrammar.end(), [&](const Grammar& g) { return g.name == words[0]; });
  if (grammar == kGrammar.end()) {
    return make_error(Errc::kInvalidArgument, "unknown fault '%.60s'", words[0].c_str());
  }
  Fault fault;
  fault.kind = grammar->kind;
  const std::string_view arguments = grammar->arguments;
  if (arguments.ends_with('o') && words.size() == arguments.size()) words.emplace_back("on");
  if (words.size() != arguments.size() + 1) return wrong_usage(*grammar);
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (!take(arguments[i], words[i + 1], *grammar, i, fault)) return wrong_usage(*grammar);
  }
  return fault;
}

std::string fault_help() {
  std::string help;
  for (const Grammar& grammar : kGrammar) add_fault_help(help, grammar.usage, grammar.meaning);
  return help;
}

Result<std::vector<ScheduledFault>> parse_fault_script(std::string_view text, double rate_hz) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 20;
  constexpr std::size_t kMostLines = 10'000;
  if (text.size() > kMostBytes) return make_error(Errc::kInvalidArgument, "the fault script is larger than 1 MiB");
  std::vector<ScheduledFault> script;
  for (std::size_t line = 1; !text.empty(); ++line) {
    const auto end = text.find('\n');
    std::string_view words = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    const auto begin = words.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos || words[begin] == '#') continue;
    if (script.size() == kMostLines) return in_line(line, "more than 10000 faults");
    words.remove_prefix(begin);
    const auto when = words.substr(0, words.find_first_of(" \t\r"));
    ScheduledFault scheduled;
    scheduled.line = line;
    if (!parse_when(when, rate_hz, scheduled.frame)) {
      return in_line(line, "it starts with a frame number or, like '1.5s', a time in seconds");
    }
    auto fault = parse_qtm_fault(words.substr(when.size()));
    if (!fault) return in_line(line, fault.error().detail.c_str());
    scheduled.fault = std::move(*fault);
    script.push_back(std::move(scheduled));
  }
  std::stable_sort(script.begin(), script.end(), [](const auto& a, const auto& b) { return a.frame < b.frame; });
  return script;
}

}  // namespace embody::sim
