#pragma once
// What the simulated QTM answers: pure functions of text.
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/qualisys/codec.hpp"

namespace embody::sim {

/// What QTM knows about its measurement.
struct QtmSetup {
  double rate_hz{0.0};
  std::string axis;
  bool calibrated{true};
  std::vector<std::string> labels;
};

struct StreamRequest {
  std::size_t divisor{1};  ///< every divisor-th frame
  std::vector<qualisys::Component> components;
};

/// The words of a command in lower case; commands do not care about case, blanks or a terminating NUL.
[[nodiscard]] std::vector<std::string> command_words(std::string_view command);

/// Minor number of a protocol version that is spoken here (1.8 to 1.28).
[[nodiscard]] std::optional<int> supported_minor_version(std::string_view version);

/// Components of `words` from `first` on; only 3D and 3DRes are simulated. Nothing when there is none or another one.
[[nodiscard]] std::optional<std::vector<qualisys::Component>> parse_components(const std::vector<std::string>& words,
                                                                               std::size_t first);

/// `StreamFrames <AllFrames|Frequency:n|FrequencyDivisor:n> <components>` over TCP.
[[nodiscard]] std::optional<StreamRequest> parse_stream(const std::vector<std::string>& words, double rate_hz);

/// The parameter text for `GetParameters <sections>`; nothing when a section does not exist. Sections other than
/// General and 3D are empty.
[[nodiscard]] std::optional<std::string> parameters_xml(const std::vector<std::string>& words, const QtmSetup& setup,
                                                        int minor_version);

}  // namespace embody::sim
