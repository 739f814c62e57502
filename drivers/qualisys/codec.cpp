#include "drivers/qualisys/codec.hpp"

#include <bit>
#include <cmath>
#include <cstring>

namespace embody::qualisys {
namespace {

constexpr std::size_t kDataHeaderSize = 24;
constexpr std::size_t kComponentHeaderSize = 8;
constexpr std::size_t kMarkersHeaderSize = 16;
constexpr double kMetresPerMillimetre = 1e-3;
constexpr std::uint32_t kMissing = 0xFFFFFFFF;

template <class T>
T load(std::span<const std::byte> bytes, std::size_t offset) noexcept {
  T value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    value = static_cast<T>(value |
                           static_cast<T>(static_cast<T>(std::to_integer<std::uint8_t>(bytes[offset + i])) << (8 * i)));
  }
  return value;
}

template <class T>
void append(std::vector<std::byte>& bytes, T value) {
  for (std::size_t i = 0; i < sizeof(T); ++i) bytes.push_back(static_cast<std::byte>((value >> (8 * i)) & 0xFF));
}

void append_header(std::vector<std::byte>& bytes, std::size_t size, PacketType type) {
  append(bytes, static_cast<std::uint32_t>(size));
  append(bytes, static_cast<std::uint32_t>(type));
}

std::size_t stride_of(Component component) noexcept {
  return component == Component::k3d ? 12 : 16;
}

double load_metres(std::span<const std::byte> bytes, std::size_t offset) noexcept {
  return kMetresPerMillimetre * static_cast<double>(std::bit_cast<float>(load<std::uint32_t>(bytes, offset)));
}

Marker load_marker(std::span<const std::byte> bytes, std::size_t offset) noexcept {
  const Eigen::Vector3d p_W(load_metres(bytes, offset), load_metres(bytes, offset + 4), load_metres(bytes, offset + 8));
  if (!p_W.allFinite()) return {};
  return {p_W, true};
}

void append_marker(std::vector<std::byte>& bytes, const Marker& marker) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto value = static_cast<float>(marker.p_W[axis] / kMetresPerMillimetre);
    append(bytes, marker.visible ? std::bit_cast<std::uint32_t>(value) : kMissing);
  }
}

Status check_whole(std::span<const std::byte> packet, PacketHeader& header) noexcept {
  const auto decoded = decode_header(packet);
  if (!decoded) return decoded.error();
  header = *decoded;
  if (header.size == packet.size()) return {};
  return make_error(Errc::kMalformed, "QTM packet of %zu bytes says it has %zu", packet.size(), header.size);
}

Status decode_markers(std::span<const std::byte> body, Component type, DataPacket& data) noexcept {
  if (body.size() < kMarkersHeaderSize) {
    return make_error(Errc::kMalformed, "QTM 3D component of %zu bytes is shorter than its header", body.size());
  }
  const std::size_t count = load<std::uint32_t>(body, 8);
  if (count > kMaxDataMarkers) {
    return make_error(Errc::kUnsupported, "QTM sends %zu labelled markers, this program handles %zu", count,
                      kMaxDataMarkers);
  }
  const std::size_t stride = stride_of(type);
  if (body.size() != kMarkersHeaderSize + count * stride) {
    return make_error(Errc::kMalformed, "QTM 3D component of %zu bytes does not hold %zu markers", body.size(), count);
  }
  data.has_markers = true;
  data.drop_rate_permille = load<std::uint16_t>(body, 12);
  data.out_of_sync_permille = load<std::uint16_t>(body, 14);
  data.markers.resize(count);
  for (std::size_t i = 0; i < count; ++i) data.markers[i] = load_marker(body, kMarkersHeaderSize + i * stride);
  return {};
}

}  // namespace

bool is_state(Event event) noexcept {
  return event != Event::kCameraSettingsChanged && event != Event::kShuttingDown && event != Event::kCaptureSaved &&
         event != Event::kTrigger;
}

Result<PacketHeader> decode_header(std::span<const std::byte> bytes) noexcept {
  if (bytes.size() < kHeaderSize) return make_error(Errc::kTruncated, "QTM packet header needs 8 bytes");
  const std::size_t size = load<std::uint32_t>(bytes, 0);
  if (size < kHeaderSize || size > kMaxPacketSize) {
    return make_error(Errc::kMalformed,
                      "the peer sent a packet of %zu bytes (allowed: 8 to %zu): is it QTM's little-endian port?", size,
                      kMaxPacketSize);
  }
  return PacketHeader{size, static_cast<PacketType>(load<std::uint32_t>(bytes, 4))};
}

Result<std::string_view> decode_text(std::span<const std::byte> packet) noexcept {
  PacketHeader header;
  if (const auto status = check_whole(packet, header); !status) return status.error();
  if (header.type != PacketType::kError && header.type != PacketType::kCommand && header.type != PacketType::kXml) {
    return make_error(Errc::kMalformed, "QTM packet of type %u is not text", static_cast<unsigned>(header.type));
  }
  const std::string_view text(reinterpret_cast<const char*>(packet.data()) + kHeaderSize, header.size - kHeaderSize);
  return text.substr(0, text.find('\0'));
}

Result<Event> decode_event(std::span<const std::byte> packet) noexcept {
  PacketHeader header;
  if (const auto status = check_whole(packet, header); !status) return status.error();
  if (header.type != PacketType::kEvent || header.size != kHeaderSize + 1) {
    return make_error(Errc::kMalformed, "QTM event packet of type %u and %zu bytes", static_cast<unsigned>(header.type),
                      header.size);
  }
  return static_cast<Event>(packet[kHeaderSize]);
}

Status decode_data(std::span<const std::byte> packet, DataPacket& data) noexcept {
  PacketHeader header;
  if (auto status = check_whole(packet, header); !status) return status;
  if (header.type != PacketType::kData || header.size < kDataHeaderSize) {
    return make_error(Errc::kMalformed, "QTM data packet of type %u and %zu bytes", static_cast<unsigned>(header.type),
                      header.size);
  }
  data.timestamp_us = load<std::uint64_t>(packet, 8);
  data.frame_number = load<std::uint32_t>(packet, 16);
  data.has_markers = false;
  data.markers.clear();
  if (data.timestamp_us > kMaxTimestampUs) return make_error(Errc::kMalformed, "QTM time stamp out of range");
  const std::size_t components = load<std::uint32_t>(packet, 20);
  auto rest = packet.subspan(kDataHeaderSize);
  for (std::size_t i = 0; i < components; ++i) {
    const std::size_t size = rest.size() < kComponentHeaderSize ? 0 : load<std::uint32_t>(rest, 0);
    if (size < kComponentHeaderSize || size > rest.size()) {
      return make_error(Errc::kMalformed, "QTM data component %zu of %zu does not fit into its packet", i + 1,
                        components);
    }
    const auto type = static_cast<Component>(load<std::uint32_t>(rest, 4));
    if (type == Component::k3d || type == Component::k3dResidual) {
      if (auto status = decode_markers(rest.first(size), type, data); !status) return status;
    }
    rest = rest.subspan(size);
  }
  if (!rest.empty()) return make_error(Errc::kMalformed, "QTM data packet has %zu bytes too many", rest.size());
  return {};
}

std::vector<std::byte> encode_text(PacketType type, std::string_view text) {
  std::vector<std::byte> bytes;
  const std::size_t size = kHeaderSize + text.size() + 1;
  bytes.reserve(size);
  append_header(bytes, size, type);
  for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
  bytes.push_back(std::byte{0});
  return bytes;
}

std::vector<std::byte> encode_event(Event event) {
  std::vector<std::byte> bytes;
  append_header(bytes, kHeaderSize + 1, PacketType::kEvent);
  bytes.push_back(static_cast<std::byte>(event));
  return bytes;
}

std::vector<std::byte> encode_no_more_data() {
  std::vector<std::byte> bytes;
  append_header(bytes, kHeaderSize, PacketType::kNoMoreData);
  return bytes;
}

std::vector<std::byte> encode_data(const DataPacket& data, std::span<const Component> components) {
  std::size_t size = kDataHeaderSize;
  for (const auto type : components) size += kMarkersHeaderSize + data.markers.size() * stride_of(type);
  std::vector<std::byte> bytes;
  bytes.reserve(size);
  append_header(bytes, size, PacketType::kData);
  append(bytes, data.timestamp_us);
  append(bytes, data.frame_number);
  append(bytes, static_cast<std::uint32_t>(components.size()));
  for (const auto type : components) {
    append(bytes, static_cast<std::uint32_t>(kMarkersHeaderSize + data.markers.size() * stride_of(type)));
    append(bytes, static_cast<std::uint32_t>(type));
    append(bytes, static_cast<std::uint32_t>(data.markers.size()));
    append(bytes, data.drop_rate_permille);
    append(bytes, data.out_of_sync_permille);
    for (const auto& marker : data.markers) {
      append_marker(bytes, marker);
      if (type == Component::k3dResidual) append(bytes, std::bit_cast<std::uint32_t>(0.0F));
    }
  }
  return bytes;
}

}  // namespace embody::qualisys
