#include "drivers/sim/qtm/wire.hpp"

namespace embody::sim {
namespace {

constexpr std::size_t kHeaderSize = 8;

}  // namespace

Bytes string_packet(Packet type, std::string_view text, ByteOrder order) {
  Bytes bytes;
  const std::size_t size = kHeaderSize + text.size() + 1;
  bytes.reserve(size);
  Writer out(bytes, order);
  out.header(size, type);
  for (const char c : text) out.u8(static_cast<std::uint8_t>(c));
  out.u8(0);
  return bytes;
}

Bytes event_packet(QtmEvent event, ByteOrder order) {
  Bytes bytes;
  Writer out(bytes, order);
  out.header(kHeaderSize + 1, Packet::kEvent);
  out.u8(static_cast<std::uint8_t>(event));
  return bytes;
}

Bytes no_more_data_packet(ByteOrder order) {
  Bytes bytes;
  Writer(bytes, order).header(kHeaderSize, Packet::kNoMoreData);
  return bytes;
}

std::uint32_t RequestReader::word(std::size_t offset) const noexcept {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto byte = std::to_integer<std::uint32_t>(bytes_[offset + i]);
    value |= byte << (8 * (order_ == ByteOrder::kBig ? 3 - i : i));
  }
  return value;
}

Result<std::optional<Request>> RequestReader::next() {
  bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(taken_));
  taken_ = 0;
  if (bytes_.size() < kHeaderSize) return std::optional<Request>{};
  const std::size_t size = word(0);
  if (size < kHeaderSize || size > kMaxRequestSize) {
    return make_error(Errc::kMalformed, "a client sent a packet of %zu bytes (allowed: 8 to %zu)", size,
                      kMaxRequestSize);
  }
  if (bytes_.size() < size) return std::optional<Request>{};
  taken_ = size;
  const std::string_view text(reinterpret_cast<const char*>(bytes_.data()) + kHeaderSize, size - kHeaderSize);
  return std::optional<Request>({word(4), text.substr(0, text.find('\0'))});
}

std::optional<std::uint16_t> discovery_reply_port(std::span<const std::byte> datagram) noexcept {
  constexpr std::byte kRequest[] = {std::byte{10}, std::byte{0}, std::byte{0}, std::byte{0},
                                    std::byte{7},  std::byte{0}, std::byte{0}, std::byte{0}};
  if (datagram.size() != 10) return {};
  for (std::size_t i = 0; i < std::size(kRequest); ++i) {
    if (datagram[i] != kRequest[i]) return {};
  }
  const auto port = static_cast<std::uint16_t>((std::to_integer<unsigned>(datagram[8]) << 8) |
                                               std::to_integer<unsigned>(datagram[9]));
  if (port == 0) return {};
  return port;
}

Bytes discovery_reply(std::string_view information, std::uint16_t base_port) {
  Bytes bytes = string_packet(Packet::kCommand, information, ByteOrder::kLittle);
  Writer(bytes, ByteOrder::kBig).u16(base_port);
  bytes[0] = static_cast<std::byte>(bytes.size() & 0xFF);  // the size counts the port too
  bytes[1] = static_cast<std::byte>((bytes.size() >> 8) & 0xFF);
  return bytes;
}

}  // namespace embody::sim
