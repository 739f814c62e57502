#pragma once
// QTM real-time protocol, little endian, versions 1.8 to 1.28: pure functions over bytes
// (Qualisys, "QTM RT Server Protocol Documentation": packet header, data frame header, 3D component).
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/base/static_vector.hpp"
#include "core/hal/types.hpp"

namespace embody::qualisys {

inline constexpr std::size_t kHeaderSize = 8;
inline constexpr std::size_t kMaxPacketSize = std::size_t{16} << 20;
inline constexpr std::size_t kMaxDataMarkers = 256;
/// Largest time stamp, µs: beyond any clock QTM can be fed with, and small enough for nanoseconds in 63 bits.
inline constexpr std::uint64_t kMaxTimestampUs = 4'000'000'000'000'000;

enum class PacketType : std::uint32_t {
  kError = 0,
  kCommand = 1,  ///< command or reply
  kXml = 2,
  kData = 3,
  kNoMoreData = 4,
  kC3dFile = 5,
  kEvent = 6,
  kDiscover = 7,
  kQtmFile = 8,
};

enum class Event : std::uint8_t {
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

/// True for events that GetState may answer with; the others only happen.
[[nodiscard]] bool is_state(Event event) noexcept;

enum class Component : std::uint32_t { k3d = 1, k3dResidual = 9 };

struct PacketHeader {
  std::size_t size{0};  ///< of the whole packet, header included
  PacketType type{PacketType::kError};
};

/// Labelled markers of one frame, in the order of the label list.
struct DataPacket {
  std::uint64_t timestamp_us{0};  ///< since the measurement started
  std::uint32_t frame_number{0};
  bool has_markers{false};  ///< a 3D component was present
  std::uint16_t drop_rate_permille{0};
  std::uint16_t out_of_sync_permille{0};
  StaticVector<Marker, kMaxDataMarkers> markers;  ///< m
};

/// Reads the header of the packet that starts at `bytes`.
/// Errors: kTruncated (fewer than 8 bytes), kMalformed (size below 8 or above kMaxPacketSize).
[[nodiscard]] Result<PacketHeader> decode_header(std::span<const std::byte> bytes) noexcept;

// The decoders below take one whole packet; its size field must equal its length (kMalformed otherwise).

/// Text of an error, command or XML packet, up to its first NUL. The view points into `packet`.
[[nodiscard]] Result<std::string_view> decode_text(std::span<const std::byte> packet) noexcept;

[[nodiscard]] Result<Event> decode_event(std::span<const std::byte> packet) noexcept;

/// Reads a data packet into `data`: components 3D and 3DRes, millimetres become metres, a marker with a coordinate that
/// is not finite is not visible. Other components are skipped by their size. On error `data` is unspecified.
/// Errors: kMalformed; kUnsupported beyond kMaxDataMarkers.
[[nodiscard]] Status decode_data(std::span<const std::byte> packet, DataPacket& data) noexcept;

/// `type` is kError, kCommand or kXml. Terminated with NUL, as QTM does.
[[nodiscard]] std::vector<std::byte> encode_text(PacketType type, std::string_view text);
[[nodiscard]] std::vector<std::byte> encode_event(Event event);
[[nodiscard]] std::vector<std::byte> encode_no_more_data();
/// One data packet with the given components, each with all markers (residual 0). A missing marker has all bits set.
[[nodiscard]] std::vector<std::byte> encode_data(const DataPacket& data, std::span<const Component> components);

}  // namespace embody::qualisys
