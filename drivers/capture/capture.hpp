#pragma once
// What passed over the link between a driver and its device, as it is in a capture file (docs/capture.md): values only.
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace embody::capture {

enum class LinkKind : std::uint8_t { kQtm, kRtde, kSerial, kCan, kUdp };
inline constexpr std::array<const char*, 5> kLinkKindNames{"qtm", "rtde", "serial", "can", "udp"};

enum class Event : std::uint8_t { kIn, kOut, kOpen, kClose };
inline constexpr std::array<const char*, 4> kEventNames{"in", "out", "open", "close"};

/// Which end of the link.
enum class End : std::uint8_t { kHost, kDevice };
inline constexpr std::array<const char*, 2> kEndNames{"host", "device"};

inline constexpr int kVersion = 1;
inline constexpr std::size_t kMaxChunkBytes = std::size_t{64} * 1024;    ///< a UDP datagram fits
inline constexpr std::size_t kMaxCaptureBytes = std::size_t{256} << 20;  ///< of a file; what is written can be read
inline constexpr std::uint32_t kMaxConnections = 65'535;
inline constexpr std::size_t kMaxHeaderText = 200;  ///< bytes of each text in the header

struct Header {
  LinkKind link{LinkKind::kQtm};
  std::string utc_start;  ///< "2026-01-31T12:00:00Z"
  std::string peer;       ///< "192.0.2.1:22223", "/dev/ttyUSB0"
  std::string program;    ///< name and version of the writer
};

/// One line. `in` is from the device to this computer, `out` the other direction. TCP and serial lines: bytes as they
/// were read, boundaries mean nothing. UDP: one datagram. CAN: one frame, its identifier as four big-endian bytes (bit
/// 31: extended), then its data.
struct Chunk {
  std::int64_t t_ns{0};         ///< CLOCK_MONOTONIC since the capture began
  std::uint32_t connection{1};  ///< counts the open events from 1
  Event event{Event::kIn};
  std::vector<std::byte> bytes;  ///< of kIn and kOut
  std::uint16_t port{0};         ///< of kOpen: the device's port; 0 where there are none
  End by{End::kHost};            ///< of kClose: who ended its direction
  bool reset{false};             ///< of kClose: both directions at once, and bytes may be lost

  friend bool operator==(const Chunk&, const Chunk&) = default;
};

/// Chunks in order of time.
struct Capture {
  Header header;
  std::vector<Chunk> chunks;
};

}  // namespace embody::capture
