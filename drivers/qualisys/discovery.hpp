#pragma once
// Which QTM computers are on the network (Qualisys, "QTM RT Server Protocol Documentation": auto discovery).
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/base/time.hpp"

namespace embody::qualisys {

inline constexpr std::uint16_t kDiscoveryPort = 22226;

/// What QTM tells about itself.
struct DiscoveryReply {
  std::string info;            ///< computer, program version and number of cameras, as one line for people
  std::uint16_t base_port{0};  ///< plus 1: the little-endian real-time port, plus 2: the big-endian one
};

struct QtmHost {
  std::string address;        ///< numeric IPv4
  std::string local_address;  ///< of ours, that the answer came to
  DiscoveryReply reply;
};

/// The question; `reply_port` is where the answer shall go. Sizes and types are little endian, the port is big endian.
[[nodiscard]] std::array<std::byte, 10> encode_discovery_request(std::uint16_t reply_port) noexcept;

/// Errors: kMalformed (size, type, no end of the text, a base port that leaves no room for the ports derived from it).
/// Characters of the text that cannot be shown become '?'.
[[nodiscard]] Result<DiscoveryReply> decode_discovery_reply(std::span<const std::byte> datagram);

/// Asks on the network of each of our `local_addresses` (transport::interface_addresses() for all of them) and collects
/// answers for `timeout`. Each QTM is listed once. What breaks the format is left out. Errors: kInvalidArgument,
/// kNotFound (an address that is not ours), kIo; with several addresses only when none could ask.
[[nodiscard]] Result<std::vector<QtmHost>> discover(const std::vector<std::string>& local_addresses, Duration timeout,
                                                    std::uint16_t port = kDiscoveryPort);

}  // namespace embody::qualisys
