#pragma once
// A client of the simulated QTM made for its tests: reads the wire by itself, in both byte orders, and keeps every
// byte.
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "drivers/sim/qtm/qtm_server.hpp"
#include "drivers/sim/qtm/wire.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::test {

using sim::ByteOrder;
using sim::Bytes;

/// Numbers at offsets, in one byte order.
class Reader {
 public:
  Reader(std::span<const std::byte> bytes, ByteOrder order) : bytes_(bytes), order_(order) {}
  [[nodiscard]] std::uint64_t number(std::size_t offset, std::size_t size) const;
  [[nodiscard]] std::uint16_t u16(std::size_t at) const { return static_cast<std::uint16_t>(number(at, 2)); }
  [[nodiscard]] std::uint32_t u32(std::size_t at) const { return static_cast<std::uint32_t>(number(at, 4)); }
  [[nodiscard]] std::uint64_t u64(std::size_t at) const { return number(at, 8); }
  [[nodiscard]] float f32(std::size_t at) const;

 private:
  std::span<const std::byte> bytes_;
  ByteOrder order_;
};

/// One packet, header included; empty when the connection has ended.
struct Received {
  Bytes bytes;
  ByteOrder order{ByteOrder::kLittle};

  [[nodiscard]] bool empty() const { return bytes.empty(); }
  [[nodiscard]] std::uint32_t type() const { return bytes.size() < 8 ? 99 : Reader(bytes, order).u32(4); }
  [[nodiscard]] std::string text() const;  ///< without the NUL, which must be there
  [[nodiscard]] int event() const { return type() == 6 ? std::to_integer<int>(bytes[8]) : -1; }
};

/// A data packet taken apart.
struct WireComponent {
  std::uint32_t type{0};
  Bytes bytes;  ///< header included
};
struct WireFrame {
  std::uint64_t timestamp_us{0};
  std::uint32_t number{0};
  std::vector<WireComponent> components;

  /// Coordinates (mm) of marker `i` of component 0, which has items of `stride` bytes.
  [[nodiscard]] std::array<float, 3> point(std::size_t i, std::size_t stride = 12) const;
  [[nodiscard]] bool missing(std::size_t i, std::size_t stride = 12) const;
  [[nodiscard]] std::uint32_t count() const;
  ByteOrder order{ByteOrder::kLittle};
};
/// Fails the test when a size does not add up.
WireFrame take_apart(const Received& packet);

/// Within ten seconds.
TimePoint soon();
bool eventually(const std::function<bool()>& condition);

class RawClient {
 public:
  explicit RawClient(std::uint16_t port, ByteOrder order = ByteOrder::kLittle);
  void send(std::string_view command);
  void send_bytes(const Bytes& bytes);
  /// The next packet; empty at the end of the connection or after ten seconds.
  Received next();
  /// Sends, then the next packet that is text, XML or, with `event`, an event.
  Received ask(std::string_view command, bool event = false);
  std::string reply(std::string_view command) { return ask(command).text(); }
  /// The next data packet; an empty frame when the connection has ended.
  WireFrame next_frame();
  /// Reads the welcome and sets the version.
  RawClient& ready(std::string_view version = "1.25");
  [[nodiscard]] int fd() const { return fd_.get(); }
  /// True when one recv() has ever brought a part of a packet only.
  [[nodiscard]] bool saw_partial_packet() const { return partial_; }
  /// True when nothing at all arrives within `duration`.
  bool silent_for(Duration duration);

 private:
  transport::UniqueFd fd_;
  ByteOrder order_;
  Bytes buffer_;
  bool partial_{false};
};

/// Datagrams that arrive at a free port of 127.0.0.1.
class UdpReceiver {
 public:
  UdpReceiver();
  [[nodiscard]] std::uint16_t port() const { return port_; }
  /// The next datagram, or an empty packet after `patience`.
  Received next(Duration patience = std::chrono::seconds(10));
  void send_to(std::uint16_t port, const Bytes& bytes);

 private:
  transport::UniqueFd fd_;
  std::uint16_t port_{0};
};

/// Marker i of frame k is at (i, k / 8, 1) mm: the frame can be told from its data.
sim::Motion counting_motion(std::vector<std::string> names, double rate_hz, std::optional<std::size_t> frames);

/// A started server.
struct Lab {
  Lab(sim::Motion motion, sim::QtmServerConfig config = {});
  sim::QtmServer server;
};

}  // namespace embody::test
