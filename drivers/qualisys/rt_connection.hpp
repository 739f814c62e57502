#pragma once
// One connection to QTM's real-time server: handshake and one command at a time, every wait with a deadline.
#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "drivers/qualisys/codec.hpp"
#include "drivers/qualisys/stream_reassembler.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::qualisys {

/// Protocol versions 1.x that are asked for, from the newest down. The layout of marker and body data is the same in
/// all of them; below 1.8 it is not.
inline constexpr int kNewestMinorVersion = 25;
inline constexpr int kOldestMinorVersion = 8;

class RtConnection {
 public:
  /// Connects, waits for the welcome and sets the protocol version: the first one that QTM accepts from
  /// 1.`newest_minor` down to 1.8. Packets of up to `buffer_size` bytes pass. A peer that vanishes without a word is
  /// noticed by the kernel within about 3 s (test_broken_link).
  /// Errors: kNotFound, kDisconnected, kTimeout, kRefused, kUnsupported (version), kMalformed; see their sentences.
  [[nodiscard]] static Result<RtConnection> open(const std::string& host, std::uint16_t port, std::size_t buffer_size,
                                                 TimePoint deadline, ByteOrder order = ByteOrder::kLittle,
                                                 int newest_minor = kNewestMinorVersion);

  /// Sends `command` and does not wait for anything.
  [[nodiscard]] Status send(std::string_view command, TimePoint deadline);

  /// Sends `command` and returns the text of the first packet of type `reply`; skips events and data. An error packet
  /// is kRefused. The protocol has no request numbers: after a timeout the connection is of no further use.
  [[nodiscard]] Result<std::string> ask(std::string_view command, PacketType reply, TimePoint deadline);

  /// The state that QTM is in.
  [[nodiscard]] Result<Event> ask_state(TimePoint deadline);

  [[nodiscard]] int fd() const noexcept { return fd_.get(); }
  [[nodiscard]] StreamReassembler& input() noexcept { return input_; }
  [[nodiscard]] ByteOrder order() const noexcept { return order_; }
  [[nodiscard]] int minor_version() const noexcept { return minor_version_; }

 private:
  RtConnection(transport::UniqueFd fd, std::size_t buffer_size, ByteOrder order)
      : fd_(std::move(fd)), input_(buffer_size, order), order_(order) {}
  Status agree_on_version(const std::string& host, int newest_minor, TimePoint deadline);
  Result<std::span<const std::byte>> wait_packet(TimePoint deadline);
  Result<std::string> wait_text(PacketType reply, TimePoint deadline);

  transport::UniqueFd fd_;
  StreamReassembler input_;
  ByteOrder order_;
  int minor_version_{0};
};

}  // namespace embody::qualisys
