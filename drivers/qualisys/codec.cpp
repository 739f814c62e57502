#include "drivers/qualisys/codec.hpp"

namespace embody::qualisys {

bool is_state(Event event) noexcept {
  return event != Event::kCameraSettingsChanged && event != Event::kShuttingDown && event != Event::kCaptureSaved &&
         event != Event::kTrigger;
}

Result<PacketHeader> decode_header(std::span<const std::byte> bytes, ByteOrder order) noexcept {
  if (bytes.size() < kHeaderSize) return make_error(Errc::kTruncated, "QTM packet header needs 8 bytes");
  const std::size_t size = load<std::uint32_t>(bytes, 0, order);
  if (size < kHeaderSize || size > kMaxPacketSize) {
    return make_error(Errc::kMalformed,
                      "the peer sent a packet of %zu bytes (allowed: 8 to %zu): is it QTM's %s-endian port?", size,
                      kMaxPacketSize, kByteOrderNames[static_cast<std::size_t>(order)]);
  }
  return PacketHeader{size, static_cast<PacketType>(load<std::uint32_t>(bytes, 4, order))};
}

Result<PacketHeader> decode_whole(std::span<const std::byte> packet, ByteOrder order) noexcept {
  const auto header = decode_header(packet, order);
  if (!header || header->size == packet.size()) return header;
  return make_error(Errc::kMalformed, "QTM packet of %zu bytes says it has %zu", packet.size(), header->size);
}

Result<std::string_view> decode_text(std::span<const std::byte> packet, ByteOrder order) noexcept {
  const auto header = decode_whole(packet, order);
  if (!header) return header.error();
  if (header->type != PacketType::kError && header->type != PacketType::kCommand && header->type != PacketType::kXml) {
    return make_error(Errc::kMalformed, "QTM packet of type %u is not text", static_cast<unsigned>(header->type));
  }
  const std::string_view text(reinterpret_cast<const char*>(packet.data()) + kHeaderSize, header->size - kHeaderSize);
  return text.substr(0, text.find('\0'));
}

Result<Event> decode_event(std::span<const std::byte> packet, ByteOrder order) noexcept {
  const auto header = decode_whole(packet, order);
  if (!header) return header.error();
  if (header->type != PacketType::kEvent || header->size != kHeaderSize + 1) {
    return make_error(Errc::kMalformed, "QTM event packet of type %u and %zu bytes",
                      static_cast<unsigned>(header->type), header->size);
  }
  return static_cast<Event>(packet[kHeaderSize]);
}

}  // namespace embody::qualisys
