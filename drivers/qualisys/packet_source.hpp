#pragma once
// The packets of one streaming session in order of arrival: all over TCP, or data over UDP and the rest over TCP.
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "drivers/qualisys/rt_connection.hpp"
#include "drivers/transport/udp.hpp"

namespace embody::qualisys {

/// Where datagrams are received.
struct UdpOptions {
  std::string address;    ///< IPv4 of one of our interfaces; empty: the one that the TCP connection uses
  std::uint16_t port{0};  ///< 0: a free one
};

class PacketSource {
 public:
  /// Takes over a connection whose handshake is done. With `udp`, binds a socket as well; only datagrams from the host
  /// at the other end of the connection are taken. Errors: kInvalidArgument (address), kIo.
  [[nodiscard]] static Result<PacketSource> open(RtConnection stream, const std::optional<UdpOptions>& udp);

  /// Asks QTM for all frames with these components. Errors: kDisconnected, kTimeout.
  [[nodiscard]] Status start(std::string_view components, TimePoint deadline);

  /// The next whole packet, valid until the next call; empty: nothing now. At most `receives` calls of the kernel since
  /// restock() bring bytes. An error ends the session. Neither blocks nor allocates.
  [[nodiscard]] Result<std::span<const std::byte>> next() noexcept;
  void restock(int receives) noexcept { receives_left_ = receives; }

  /// When the packet that next() returned left the kernel.
  [[nodiscard]] TimePoint t_received() const noexcept { return t_received_; }
  /// Readable when next() may have something.
  [[nodiscard]] int fd() const noexcept { return epoll_ ? epoll_.get() : stream_.fd(); }
  /// Wakes a reader and makes its next() fail. From any thread.
  void cut() const noexcept;

  [[nodiscard]] ByteOrder order() const noexcept { return stream_.order(); }
  [[nodiscard]] bool is_udp() const noexcept { return static_cast<bool>(udp_); }
  [[nodiscard]] std::string udp_name() const;                                    ///< address and port that QTM sends to
  [[nodiscard]] std::uint64_t foreign() const noexcept { return foreign_; }      ///< datagrams of other hosts
  [[nodiscard]] std::uint64_t malformed() const noexcept { return malformed_; }  ///< datagrams that are no packet
  void count_malformed() noexcept { ++malformed_; }

 private:
  explicit PacketSource(RtConnection stream) : stream_(std::move(stream)) {}
  Status open_udp(const UdpOptions& options);
  Result<std::span<const std::byte>> next_of_stream() noexcept;
  Result<std::span<const std::byte>> next_datagram() noexcept;

  RtConnection stream_;
  transport::UniqueFd udp_;
  transport::UniqueFd epoll_;  // of both sockets
  std::vector<std::byte> datagram_;
  std::uint32_t qtm_address_{0};
  TimePoint t_received_{};
  int receives_left_{0};
  std::uint64_t foreign_{0};
  std::uint64_t malformed_{0};
};

}  // namespace embody::qualisys
