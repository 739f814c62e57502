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

/// The protocol version spoken here. The layout of marker data is the same from 1.8 to 1.28.
inline constexpr std::string_view kProtocolVersion = "1.25";

class RtConnection {
 public:
  /// Connects, waits for the welcome and sets the protocol version. Packets of up to `buffer_size` bytes pass.
  /// Errors: kNotFound, kDisconnected, kTimeout, kRefused, kUnsupported (version), kMalformed; see their sentences.
  [[nodiscard]] static Result<RtConnection> open(const std::string& host, std::uint16_t port, std::size_t buffer_size,
                                                 TimePoint deadline);

  /// Sends `command` and does not wait for anything.
  [[nodiscard]] Status send(std::string_view command, TimePoint deadline);

  /// Sends `command` and returns the text of the first packet of type `reply`; skips events and data. An error packet
  /// is kRefused. The protocol has no request numbers: after a timeout the connection is of no further use.
  [[nodiscard]] Result<std::string> ask(std::string_view command, PacketType reply, TimePoint deadline);

  /// State that QTM is in.
  [[nodiscard]] Result<Event> ask_state(TimePoint deadline);

  [[nodiscard]] int fd() const noexcept { return fd_.get(); }
  [[nodiscard]] StreamReassembler& input() noexcept { return input_; }

 private:
  RtConnection(transport::UniqueFd fd, std::size_t buffer_size) : fd_(std::move(fd)), input_(buffer_size) {}
  Result<std::span<const std::byte>> wait_packet(TimePoint deadline);
  Result<std::string> wait_text(PacketType reply, TimePoint deadline);

  transport::UniqueFd fd_;
  StreamReassembler input_;
};

}  // namespace embody::qualisys
