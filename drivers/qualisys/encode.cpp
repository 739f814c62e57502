#include <bit>

#include "drivers/qualisys/codec.hpp"

namespace embody::qualisys {
namespace {

constexpr auto kLittle = ByteOrder::kLittle;
constexpr std::size_t kDataHeaderSize = 24;
constexpr std::size_t kMarkersHeaderSize = 16;
constexpr std::uint32_t kMissing = 0xFFFFFFFF;

void append_header(std::vector<std::byte>& bytes, std::size_t size, PacketType type, ByteOrder order) {
  append(bytes, static_cast<std::uint32_t>(size), order);
  append(bytes, static_cast<std::uint32_t>(type), order);
}

std::size_t stride_of(Component component) noexcept {
  return component == Component::k3d ? 12 : 16;
}

void append_marker(std::vector<std::byte>& bytes, const Marker& marker) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto millimetres = static_cast<float>(marker.p_W[axis] / 1e-3);
    append(bytes, marker.visible ? std::bit_cast<std::uint32_t>(millimetres) : kMissing, kLittle);
  }
}

}  // namespace

std::vector<std::byte> encode_text(PacketType type, std::string_view text, ByteOrder order) {
  std::vector<std::byte> bytes;
  const std::size_t size = kHeaderSize + text.size() + 1;
  bytes.reserve(size);
  append_header(bytes, size, type, order);
  for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
  bytes.push_back(std::byte{0});
  return bytes;
}

std::vector<std::byte> encode_event(Event event) {
  std::vector<std::byte> bytes;
  append_header(bytes, kHeaderSize + 1, PacketType::kEvent, kLittle);
  bytes.push_back(static_cast<std::byte>(event));
  return bytes;
}

std::vector<std::byte> encode_no_more_data() {
  std::vector<std::byte> bytes;
  append_header(bytes, kHeaderSize, PacketType::kNoMoreData, kLittle);
  return bytes;
}

std::vector<std::byte> encode_data(const DataPacket& data, std::span<const Component> components) {
  std::size_t size = kDataHeaderSize;
  for (const auto type : components) size += kMarkersHeaderSize + data.markers.size() * stride_of(type);
  std::vector<std::byte> bytes;
  bytes.reserve(size);
  append_header(bytes, size, PacketType::kData, kLittle);
  append(bytes, data.timestamp_us, kLittle);
  append(bytes, data.frame_number, kLittle);
  append(bytes, static_cast<std::uint32_t>(components.size()), kLittle);
  for (const auto type : components) {
    append(bytes, static_cast<std::uint32_t>(kMarkersHeaderSize + data.markers.size() * stride_of(type)), kLittle);
    append(bytes, static_cast<std::uint32_t>(type), kLittle);
    append(bytes, static_cast<std::uint32_t>(data.markers.size()), kLittle);
    append(bytes, data.drop_rate_permille, kLittle);
    append(bytes, data.out_of_sync_permille, kLittle);
    for (const auto& marker : data.markers) {
      append_marker(bytes, marker);
      if (type == Component::k3dResidual) append(bytes, std::bit_cast<std::uint32_t>(0.0F), kLittle);
    }
  }
  return bytes;
}

}  // namespace embody::qualisys
