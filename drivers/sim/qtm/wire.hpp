#pragma once
// Bytes of the QTM real-time protocol as QTM writes them, in the byte order of the port (Qualisys, "QTM RT Server
// Protocol Documentation": packet header, string, event and discovery packets). Written apart from the client's codec,
// so that one misreading of the document does not hide in both.
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"

namespace embody::sim {

using Bytes = std::vector<std::byte>;

enum class ByteOrder : std::uint8_t { kLittle, kBig };

/// Packet types of the protocol that this server reads or writes.
enum class Packet : std::uint32_t { kError = 0, kCommand = 1, kXml = 2, kData = 3, kNoMoreData = 4, kEvent = 6 };

/// Events of the protocol. Number 5 is not used any more.
enum class QtmEvent : std::uint8_t {
  kConnected = 1,
  kConnectionClosed = 2,
  kCaptureStarted = 3,
  kCaptureStopped = 4,
  kCalibrationStarted = 6,
  kCalibrationStopped = 7,
  kPlaybackStarted = 8,
  kPlaybackStopped = 9,
  kWaitingForTrigger = 10,
  kCameraSettingsChanged = 11,
  kShuttingDown = 12,
  kCaptureSaved = 13,
  kReprocessingStarted = 14,
  kReprocessingStopped = 15,
  kTrigger = 16,
};

/// False for the events that only happen: GetState never answers with them.
[[nodiscard]] constexpr bool tells_state(QtmEvent event) noexcept {
  return event != QtmEvent::kCameraSettingsChanged && event != QtmEvent::kShuttingDown &&
         event != QtmEvent::kCaptureSaved && event != QtmEvent::kTrigger;
}

/// Appends numbers in one byte order.
class Writer {
 public:
  Writer(Bytes& bytes, ByteOrder order) : bytes_(bytes), big_(order == ByteOrder::kBig) {}
  void u8(std::uint8_t value) { append(value); }
  void u16(std::uint16_t value) { append(value); }
  void u32(std::uint32_t value) { append(value); }
  void u64(std::uint64_t value) { append(value); }
  void f32(double value) { append(std::bit_cast<std::uint32_t>(static_cast<float>(value))); }
  /// Size of the packet and its type.
  void header(std::size_t size, Packet type) {
    u32(static_cast<std::uint32_t>(size));
    u32(static_cast<std::uint32_t>(type));
  }

 private:
  template <class T>
  void append(T value) {
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      const std::size_t shift = 8 * (big_ ? sizeof(T) - 1 - i : i);
      bytes_.push_back(static_cast<std::byte>((value >> shift) & 0xFF));
    }
  }
  Bytes& bytes_;
  bool big_;
};

/// A string packet, terminated with NUL as QTM does.
[[nodiscard]] Bytes string_packet(Packet type, std::string_view text, ByteOrder order);
[[nodiscard]] Bytes event_packet(QtmEvent event, ByteOrder order);
[[nodiscard]] Bytes no_more_data_packet(ByteOrder order);

/// One packet from a client.
struct Request {
  std::uint32_t type{0};
  std::string_view text;  ///< up to the first NUL
};

/// Cuts the bytes of one client into requests; holds at most one unfinished packet of kMaxRequestSize bytes.
class RequestReader {
 public:
  static constexpr std::size_t kMaxRequestSize = std::size_t{64} << 10;
  explicit RequestReader(ByteOrder order) : order_(order) {}

  void push(std::span<const std::byte> bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  /// The next whole packet, valid until the next call; empty when more bytes are needed.
  /// Error kMalformed: a size below 8 or above kMaxRequestSize; the stream cannot go on.
  [[nodiscard]] Result<std::optional<Request>> next();

 private:
  [[nodiscard]] std::uint32_t word(std::size_t offset) const noexcept;
  ByteOrder order_;
  Bytes bytes_;
  std::size_t taken_{0};  // bytes of the packet handed out last
};

/// UDP port to which the reply to a discovery packet goes; nothing when `datagram` is none (8-byte header of 10 and 7
/// in little endian, then the port in big endian).
[[nodiscard]] std::optional<std::uint16_t> discovery_reply_port(std::span<const std::byte> datagram) noexcept;

/// Answer to discovery: "HOST, QTM 2023.3 (build 13590), 7 cameras" and the base port, from which the client derives
/// the others.
[[nodiscard]] Bytes discovery_reply(std::string_view information, std::uint16_t base_port);

}  // namespace embody::sim
