#pragma once
// A source filter for UDP sockets of this process. Cyclone pinned to one interface still binds 0.0.0.0, so a datagram
// that arrives on any other interface would be read; a classic BPF program on the socket drops it in the kernel.
#include <sys/types.h>

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"

namespace embody::dds {

inline constexpr std::size_t kMaxNetworks = 16;

/// An IPv4 network in host byte order; `address` has no bit outside of `mask`.
struct Network {
  std::uint32_t address{0};
  std::uint32_t mask{0};
  friend bool operator==(const Network&, const Network&) = default;
};

/// Reads "a.b.c.d/n" (0 <= n <= 32) or "a.b.c.d". Errors: other text, or host bits that are not zero.
[[nodiscard]] Result<Network> parse_network(std::string_view text);

/// 127.0.0.0/8, and the networks of the IPv4 addresses of `interface` unless that is the loopback.
/// Errors: no such interface, or one without an IPv4 address.
[[nodiscard]] Result<std::vector<Network>> networks_of(const std::string& interface);

/// A UDP socket of this process. The inode tells a reused descriptor from the old one.
struct UdpSocket {
  int fd{-1};
  ino_t inode{0};
  friend bool operator==(const UdpSocket&, const UdpSocket&) = default;
};

/// Every UDP socket that this process has open, by walking /proc/self/fd.
[[nodiscard]] Result<std::vector<UdpSocket>> udp_sockets();

/// From now on the kernel drops every datagram to the IPv4 UDP socket `fd` whose source lies in none of `networks`
/// (1 to kMaxNetworks), and refuses to remove the filter. Datagrams queued before stay.
[[nodiscard]] Status accept_only(int fd, std::span<const Network> networks);

}  // namespace embody::dds
