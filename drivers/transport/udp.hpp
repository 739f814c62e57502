#pragma once
// UDP over non-blocking descriptors, IPv4. None of these functions throws.
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/hal/hand_tracker.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::transport {

/// A network as its address and mask, both in host byte order.
struct Network {
  std::uint32_t address{0};
  std::uint32_t mask{0xffffffff};

  [[nodiscard]] bool contains(std::uint32_t host) const noexcept { return (host & mask) == (address & mask); }
};

/// The network of the interface that owns `address` (numeric IPv4); 127.0.0.0/8 for a loopback address.
/// Errors: kInvalidArgument (no IPv4 address, or 0.0.0.0, which is no interface), kNotFound (no interface has it).
[[nodiscard]] Result<Network> network_of(const std::string& address);

/// A socket that receives at `address` (numeric IPv4 of one interface); port 0 takes a free one. `buffer_bytes` bounds
/// what the kernel keeps; more is dropped there. Errors: kInvalidArgument, kIo.
[[nodiscard]] Result<UniqueFd> udp_bind(const std::string& address, std::uint16_t port, int buffer_bytes);

/// A socket whose send_message() (tcp.hpp) goes to `address` (numeric IPv4) and `port`. Nothing is sent yet, so nobody
/// needs to listen. Errors: kInvalidArgument, kIo.
[[nodiscard]] Result<UniqueFd> udp_connect(const std::string& address, std::uint16_t port);

/// What one non-blocking receive brought.
struct Datagram {
  IoStatus status{IoStatus::kEmpty};  ///< kDone, kEmpty, or kDisconnected: the socket is broken
  std::size_t size{0};                ///< of the datagram as sent; greater than the buffer: it was cut
  std::uint32_t source{0};            ///< IPv4 address of the sender, host byte order
};

/// One recvfrom() without waiting. A datagram may be empty: kDone with size 0.
[[nodiscard]] Datagram receive_datagram(int fd, std::span<std::byte> buffer) noexcept;

/// IPv4 addresses of this computer's interfaces that are up, loopback included.
[[nodiscard]] std::vector<std::string> interface_addresses();

/// Where a datagram reaches everybody on the network of the interface that owns `address`; for a loopback address that
/// address itself. Errors: those of network_of().
[[nodiscard]] Result<std::string> broadcast_address(const std::string& address);

/// Sends one datagram from a bound socket to `address` (numeric IPv4, a broadcast address too) without waiting.
/// Errors: kInvalidArgument, kIo.
[[nodiscard]] Status send_datagram(int fd, const std::string& address, std::uint16_t port,
                                   std::span<const std::byte> datagram);

/// IPv4 address of this side or of the peer of a connected socket, host byte order; 0 on failure.
[[nodiscard]] std::uint32_t own_address(int fd) noexcept;
[[nodiscard]] std::uint32_t peer_address(int fd) noexcept;

/// `address` (host byte order) as text: 192.0.2.1.
[[nodiscard]] std::string dotted(std::uint32_t address);

}  // namespace embody::transport
