#pragma once
// UDP over non-blocking descriptors, IPv4. None of these functions throws.
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

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

}  // namespace embody::transport
