#pragma once
// One connection of the simulated QTM, with its UDP stream if it asked for one.
#include <sys/socket.h>

#include <memory>
#include <optional>
#include <string>

#include "drivers/sim/qtm/command_desk.hpp"
#include "drivers/sim/qtm/wire.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::sim {

/// Faults of the way to the clients.
struct LinkFaults {
  bool silent{false};  ///< nothing is sent
  bool split_udp{false};
  bool reorder_udp{false};
  bool duplicate_udp{false};
};

class Client {
 public:
  Client(transport::UniqueFd socket, ByteOrder order, std::uint64_t id);

  [[nodiscard]] int fd() const noexcept { return fd_.get(); }
  [[nodiscard]] bool dead() const noexcept { return dead_; }
  /// Ends the connection; its owner releases the descriptor later.
  void close();

  /// One send() per packet; a client whose buffer is full has not read for long and is dropped.
  void send(const Bytes& packet, const LinkFaults& faults);
  void send(const Reply& reply, const LinkFaults& faults);
  void send(QtmEvent event, const LinkFaults& faults);
  /// A frame of its stream, over TCP or UDP.
  void send_frame(const FrameData& frame, const LinkFaults& faults);
  /// Opens the UDP socket of conversation.stream, if it names one. Error: the address is none, or outside loopback
  /// without `anywhere`.
  [[nodiscard]] Status open_stream(bool anywhere);

  Conversation conversation;
  RequestReader input;
  bool awaits_calibration{false};
  std::optional<std::size_t> last_frame;  ///< tick of the last GetCurrentFrame

 private:
  void send_datagram(Bytes packet, const LinkFaults& faults);

  transport::UniqueFd fd_;
  transport::UniqueFd udp_;
  std::string address_;
  Bytes held_;  // a datagram that the next one overtakes
  bool dead_{false};
};

}  // namespace embody::sim
