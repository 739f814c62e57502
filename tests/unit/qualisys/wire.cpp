#include "tests/unit/qualisys/wire.hpp"

#include <bit>
#include <cstring>

namespace embody::test {
namespace {

/// Puts the object's bytes in the wanted order; the machine is little endian.
template <class T>
void put(Bytes& bytes, T value, ByteOrder order) {
  std::array<std::byte, sizeof(T)> raw{};
  std::memcpy(raw.data(), &value, sizeof(T));
  if (order == ByteOrder::kLittle) bytes.insert(bytes.end(), raw.begin(), raw.end());
  if (order == ByteOrder::kBig) bytes.insert(bytes.end(), raw.rbegin(), raw.rend());
}

Bytes packet(std::uint32_t type, const Bytes& payload, ByteOrder order) {
  Bytes bytes;
  put(bytes, static_cast<std::uint32_t>(8 + payload.size()), order);
  put(bytes, type, order);
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  return bytes;
}

}  // namespace

Bytes wire_data(const WireFrame& frame, ByteOrder order) {
  Bytes payload;
  put(payload, frame.timestamp_us, order);
  put(payload, frame.number, order);
  put(payload, static_cast<std::uint32_t>(frame.parts.size()), order);
  for (const WirePart& part : frame.parts) {
    Bytes body = part.raw;
    if (body.empty()) {
      put(body, static_cast<std::uint32_t>(part.items.size()), order);
      put(body, frame.drop_rate_permille, order);
      put(body, frame.out_of_sync_permille, order);
      for (const auto& item : part.items) {
        for (const float number : item) put(body, std::bit_cast<std::uint32_t>(number), order);
      }
    }
    const Bytes component = packet(part.type, body, order);  // same header: size, then type
    payload.insert(payload.end(), component.begin(), component.end());
  }
  return packet(3, payload, order);
}

Bytes wire_text(std::uint32_t type, std::string_view text, ByteOrder order) {
  Bytes payload;
  for (const char c : text) payload.push_back(static_cast<std::byte>(c));
  payload.push_back(std::byte{0});
  return packet(type, payload, order);
}

Bytes wire_event(unsigned event, ByteOrder order) {
  return packet(6, {static_cast<std::byte>(event)}, order);
}

Bytes wire_no_more_data(ByteOrder order) {
  return packet(4, {}, order);
}

std::vector<float> wire_body(const Pose& X_W, float residual_mm) {
  std::vector<float> numbers;
  for (int axis = 0; axis < 3; ++axis) numbers.push_back(static_cast<float>(1e3 * X_W.translation()[axis]));
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) numbers.push_back(static_cast<float>(X_W.linear()(row, column)));
  }
  if (residual_mm >= 0.0F) numbers.push_back(residual_mm);
  return numbers;
}

std::vector<float> wire_missing(std::size_t count) {
  return std::vector<float>(count, std::bit_cast<float>(0xFFFFFFFFU));
}

}  // namespace embody::test
