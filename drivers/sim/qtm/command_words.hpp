#pragma once
// The words of a client's command, and what StreamFrames and GetCurrentFrame ask for: pure functions of text.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim/qtm/frame_encoder.hpp"

namespace embody::sim {

inline constexpr int kOldestMinorVersion = 8;  ///< of protocol 1.x that data is served in
inline constexpr int kNewestMinorVersion = 28;

/// A whole number without sign; nothing when anything else is in `text`.
[[nodiscard]] std::optional<std::uint64_t> parse_count(std::string_view text) noexcept;

/// The words of a command, as written; blanks and everything from the first NUL on do not count.
[[nodiscard]] std::vector<std::string> command_words(std::string_view command);

[[nodiscard]] std::string lower_case(std::string_view text);

/// Minor number of a protocol version that is spoken here (1.8 to 1.28).
[[nodiscard]] std::optional<int> supported_minor_version(std::string_view version) noexcept;

/// Components named by `words` from `first` on, each once, as far as protocol 1.`minor_version` knows them. Nothing
/// when there is none, an unknown one, or a malformed channel list (`Analog:1,3-6`).
[[nodiscard]] std::optional<std::vector<Component>> parse_components(const std::vector<std::string>& words,
                                                                     std::size_t first, int minor_version);

/// Where a stream goes instead of its TCP connection.
struct UdpTarget {
  std::string address;  ///< empty: the address of the client
  std::uint16_t port{0};
};

struct StreamRequest {
  std::size_t divisor{1};  ///< every divisor-th frame
  std::vector<Component> components;
  std::optional<UdpTarget> udp;
};

/// `StreamFrames <AllFrames|Frequency:n|FrequencyDivisor:n> [UDP[:address]:port] <components>` of a measurement at
/// `rate_hz`. UDP ports are 1023 to 65535.
[[nodiscard]] std::optional<StreamRequest> parse_stream(const std::vector<std::string>& words, double rate_hz,
                                                        int minor_version);

}  // namespace embody::sim
