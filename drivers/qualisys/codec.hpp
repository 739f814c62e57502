#pragma once
// QTM real-time protocol, versions 1.8 to 1.28, either byte order: pure functions over bytes
// (Qualisys, "QTM RT Server Protocol Documentation": packet header, data frame header, 3D and 6D components).
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/base/static_vector.hpp"
#include "core/hal/types.hpp"
#include "drivers/qualisys/byte_order.hpp"

namespace embody::qualisys {

inline constexpr std::size_t kHeaderSize = 8;
inline constexpr std::size_t kMaxPacketSize = std::size_t{16} << 20;
inline constexpr std::size_t kMaxDataMarkers = 256;
inline constexpr std::size_t kMaxDataBodies = 64;
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

/// The components that are read here.
enum class Component : std::uint32_t { k3d = 1, k6d = 5, k3dResidual = 9, k6dResidual = 11 };

struct PacketHeader {
  std::size_t size{0};  ///< of the whole packet, header included
  PacketType type{PacketType::kError};
};

/// Labelled markers and rigid bodies of one frame, in the order of QTM's lists.
struct DataPacket {
  std::uint64_t timestamp_us{0};  ///< since the measurement started
  std::uint32_t frame_number{0};
  bool has_markers{false};  ///< a 3D component was present
  bool has_bodies{false};   ///< a 6D component was present
  std::uint16_t drop_rate_permille{0};
  std::uint16_t out_of_sync_permille{0};
  StaticVector<Marker, kMaxDataMarkers> markers;   ///< m
  StaticVector<RigidBody, kMaxDataBodies> bodies;  ///< m; residual 0 without a 6DRes component
};

/// What a marker with this residual (mean distance of its rays, m) is worth, 0..1: 1 up to 2 mm, which calibrated
/// cameras keep, then falling with its square. A residual that is negative or not a number says nothing: 1.
[[nodiscard]] float confidence_of(double residual_m) noexcept;

/// Reads the header of the packet that starts at `bytes`.
/// Errors: kTruncated (fewer than 8 bytes), kMalformed (size below 8 or above kMaxPacketSize).
[[nodiscard]] Result<PacketHeader> decode_header(std::span<const std::byte> bytes,
                                                 ByteOrder order = ByteOrder::kLittle) noexcept;

// The decoders below take one whole packet; its size field must equal its length (kMalformed otherwise).

/// The header of a packet that is whole.
[[nodiscard]] Result<PacketHeader> decode_whole(std::span<const std::byte> packet,
                                                ByteOrder order = ByteOrder::kLittle) noexcept;

/// Text of an error, command or XML packet, up to its first NUL. The view points into `packet`.
[[nodiscard]] Result<std::string_view> decode_text(std::span<const std::byte> packet,
                                                   ByteOrder order = ByteOrder::kLittle) noexcept;

[[nodiscard]] Result<Event> decode_event(std::span<const std::byte> packet,
                                         ByteOrder order = ByteOrder::kLittle) noexcept;

/// Reads a data packet into `data`: components 3D, 3DRes, 6D and 6DRes; the last one of a kind counts. Millimetres
/// become metres. A marker with a coordinate that is not finite is not visible; neither is a body with such a number or
/// without a rotation (orthonormal within 0.01, right-handed; it is made exact). Rotations arrive column by column.
/// Other components are skipped by their size. On error `data` is unspecified.
/// Errors: kMalformed; kUnsupported beyond kMaxDataMarkers or kMaxDataBodies.
[[nodiscard]] Status decode_data(std::span<const std::byte> packet, DataPacket& data,
                                 ByteOrder order = ByteOrder::kLittle) noexcept;

/// `type` is kError, kCommand or kXml. Terminated with NUL, as QTM does.
[[nodiscard]] std::vector<std::byte> encode_text(PacketType type, std::string_view text,
                                                 ByteOrder order = ByteOrder::kLittle);
[[nodiscard]] std::vector<std::byte> encode_event(Event event);
[[nodiscard]] std::vector<std::byte> encode_no_more_data();
/// One little-endian data packet with the given 3D and 3DRes components, each with all markers (residual 0). A missing
/// marker has all bits set.
[[nodiscard]] std::vector<std::byte> encode_data(const DataPacket& data, std::span<const Component> components);

}  // namespace embody::qualisys
