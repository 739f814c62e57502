#include "drivers/sim/qtm/command_words.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace embody::sim {
namespace {

struct ComponentName {
  const char* name;
  Component component;
  int oldest;              // minor version that brought it
  const char* option{""};  // what may follow a colon: channels or "global"
};

constexpr int kLastVersionWithAll = 18;
constexpr std::array<ComponentName, 19> kComponents{{{"3d", Component::k3d, 0},
                                                     {"3dres", Component::k3dResidual, 2},
                                                     {"3dnolabels", Component::k3dNoLabels, 0},
                                                     {"3dnolabelsres", Component::k3dNoLabelsResidual, 2},
                                                     {"analog", Component::kAnalog, 0, "channels"},
                                                     {"analogsingle", Component::kAnalogSingle, 0, "channels"},
                                                     {"force", Component::kForce, 0},
                                                     {"forcesingle", Component::kForceSingle, 9},
                                                     {"6d", Component::k6d, 0},
                                                     {"6dres", Component::k6dResidual, 2},
                                                     {"6deuler", Component::k6dEuler, 0},
                                                     {"6deulerres", Component::k6dEulerResidual, 2},
                                                     {"2d", Component::k2d, 0},
                                                     {"2dlin", Component::k2dLinear, 0},
                                                     {"image", Component::kImage, 8},
                                                     {"gazevector", Component::kGazeVector, 11},
                                                     {"timecode", Component::kTimecode, 17},
                                                     {"skeleton", Component::kSkeleton, 19, "global"},
                                                     {"eyetracker", Component::kEyeTracker, 21}}};

bool blank(char c) noexcept {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

/// "1,3-6": numbers and ranges.
bool is_channel_list(std::string_view text) noexcept {
  while (true) {
    const auto comma = text.find(',');
    const auto item = text.substr(0, comma);
    const auto dash = item.find('-');
    const auto first = parse_count(item.substr(0, dash));
    const auto last = dash == std::string_view::npos ? first : parse_count(item.substr(dash + 1));
    if (!first || !last || *first == 0 || *last < *first) return false;
    if (comma == std::string_view::npos) return true;
    text.remove_prefix(comma + 1);
  }
}

std::optional<Component> parse_component(std::string_view word, int minor_version) {
  const auto colon = word.find(':');
  const auto name = word.substr(0, colon);
  const auto* found =
      std::find_if(kComponents.begin(), kComponents.end(), [&](const auto& c) { return c.name == name; });
  if (found == kComponents.end() || found->oldest > minor_version) return {};
  if (colon == std::string_view::npos) return found->component;
  const auto option = word.substr(colon + 1);
  const std::string_view allowed = found->option;
  const bool fits = allowed == "channels" ? is_channel_list(option) : !allowed.empty() && option == allowed;
  if (!fits) return {};
  return found->component;
}

/// "udp:port" or "udp:address:port".
std::optional<UdpTarget> parse_udp(std::string_view word) {
  constexpr std::uint64_t kFirstPort = 1023;
  auto rest = word.substr(word.find(':') + 1);
  UdpTarget target;
  if (const auto colon = rest.find(':'); colon != std::string_view::npos) {
    target.address = rest.substr(0, colon);
    if (target.address.empty()) return {};
    rest.remove_prefix(colon + 1);
  }
  const auto port = parse_count(rest);
  if (!port || *port < kFirstPort || *port > 65535) return {};
  target.port = static_cast<std::uint16_t>(*port);
  return target;
}

/// Every how many frames of a measurement at `rate_hz`; 0 when `word` is no rate.
std::size_t parse_rate(std::string_view word, double rate_hz) {
  constexpr std::string_view kFrequency = "frequency:";
  constexpr std::string_view kDivisor = "frequencydivisor:";
  if (word == "allframes") return 1;
  if (word.starts_with(kDivisor)) return parse_count(word.substr(kDivisor.size())).value_or(0);
  if (!word.starts_with(kFrequency)) return 0;
  const auto frequency_hz = parse_count(word.substr(kFrequency.size())).value_or(0);
  if (frequency_hz == 0) return 0;
  return static_cast<std::size_t>(std::max(1.0, std::round(rate_hz / static_cast<double>(frequency_hz))));
}

}  // namespace

std::optional<std::uint64_t> parse_count(std::string_view text) noexcept {
  std::uint64_t value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc{} || end != text.data() + text.size()) return {};
  return value;
}

std::vector<std::string> command_words(std::string_view command) {
  std::vector<std::string> words;
  bool inside = false;
  for (const char c : command.substr(0, command.find('\0'))) {
    if (!blank(c) && !inside) words.emplace_back();
    if (!blank(c)) words.back() += c;
    inside = !blank(c);
  }
  return words;
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return lower;
}

std::optional<int> supported_minor_version(std::string_view version) noexcept {
  constexpr std::string_view kMajor = "1.";
  if (!version.starts_with(kMajor)) return {};
  const auto minor = parse_count(version.substr(kMajor.size()));
  if (!minor || *minor < std::uint64_t{kOldestMinorVersion} || *minor > std::uint64_t{kNewestMinorVersion}) return {};
  return static_cast<int>(*minor);
}

std::optional<std::vector<Component>> parse_components(const std::vector<std::string>& words, std::size_t first,
                                                       int minor_version) {
  std::vector<Component> components;
  const auto add = [&components](Component component) {
    if (std::find(components.begin(), components.end(), component) == components.end()) components.push_back(component);
  };
  for (std::size_t i = first; i < words.size(); ++i) {
    const std::string word = lower_case(words[i]);
    if (word == "all" && minor_version <= kLastVersionWithAll) {
      for (const auto& known : kComponents) {
        if (known.oldest <= minor_version) add(known.component);
      }
      continue;
    }
    const auto component = parse_component(word, minor_version);
    if (!component) return {};
    add(*component);
  }
  if (components.empty()) return {};
  return components;
}

std::optional<StreamRequest> parse_stream(const std::vector<std::string>& words, double rate_hz, int minor_version) {
  if (words.size() < 3) return {};
  StreamRequest request;
  request.divisor = parse_rate(lower_case(words[1]), rate_hz);
  if (request.divisor == 0) return {};
  std::size_t first = 2;
  if (const auto word = lower_case(words[2]); word.starts_with("udp:")) {
    request.udp = parse_udp(word);
    if (!request.udp) return {};
    ++first;
  }
  auto components = parse_components(words, first, minor_version);
  if (!components) return {};
  request.components = std::move(*components);
  return request;
}

}  // namespace embody::sim
