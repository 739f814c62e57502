#include "drivers/landmarks/codec.hpp"

#include <bit>
#include <cmath>
#include <concepts>

namespace embody::landmarks {
namespace {

/// Unsigned little-endian number of sizeof(T) bytes at `at`.
template <std::unsigned_integral T>
T load(std::span<const std::byte> bytes, std::size_t at) noexcept {
  T value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    value = static_cast<T>(value | static_cast<T>(std::to_integer<T>(bytes[at + i]) << (8 * i)));
  }
  return value;
}

template <std::unsigned_integral T>
void store(std::span<std::byte> bytes, std::size_t at, T value) noexcept {
  for (std::size_t i = 0; i < sizeof(T); ++i) bytes[at + i] = static_cast<std::byte>(value >> (8 * i));
}

constexpr std::size_t place(std::size_t landmark, std::size_t number) noexcept {
  return kHeaderSize + sizeof(float) * (4 * landmark + number);
}

Status check_header(std::span<const std::byte> datagram) noexcept {
  if (datagram.size() != kDatagramSize) {
    return make_error(Errc::kMalformed, "a landmark datagram has %zu bytes, not %zu", kDatagramSize, datagram.size());
  }
  for (std::size_t i = 0; i < kMagic.size(); ++i) {
    if (std::to_integer<char>(datagram[i]) != kMagic[i]) {
      return make_error(Errc::kMalformed, "a landmark datagram starts with EMLM");
    }
  }
  if (const auto version = load<std::uint16_t>(datagram, 4); version != kVersion) {
    return make_error(Errc::kUnsupported, "landmark datagrams of version %u are unknown; send version %u",
                      unsigned{version}, unsigned{kVersion});
  }
  if (const auto side = load<std::uint8_t>(datagram, 6); side > 1) {
    return make_error(Errc::kMalformed, "side %u is neither 0 (right) nor 1 (left)", unsigned{side});
  }
  if (load<std::uint8_t>(datagram, 7) != 0) return make_error(Errc::kMalformed, "byte 7 of a landmark datagram is 0");
  return {};
}

}  // namespace

Result<LandmarkFrame> decode(std::span<const std::byte> datagram) noexcept {
  if (const Status status = check_header(datagram); !status) return status.error();
  LandmarkFrame frame;
  frame.side = load<std::uint8_t>(datagram, 6) == 0 ? Side::kRight : Side::kLeft;
  frame.frame_number = load<std::uint64_t>(datagram, 8);
  frame.t_capture_ns = static_cast<std::int64_t>(load<std::uint64_t>(datagram, 16));
  if (frame.t_capture_ns < 0) return make_error(Errc::kMalformed, "the capture time is negative");
  for (std::size_t i = 0; i < kLandmarkCount; ++i) {
    std::array<float, 4> numbers{};
    for (std::size_t k = 0; k < 4; ++k) numbers[k] = std::bit_cast<float>(load<std::uint32_t>(datagram, place(i, k)));
    LandmarkFrame::Landmark& landmark = frame.landmarks[i];
    landmark = {{numbers[0], numbers[1], numbers[2]}, numbers[3]};
    for (const float x : landmark.p_W) {  // written so that NaN fails
      if (!(std::abs(x) <= kFarthestMetres)) {
        return make_error(Errc::kMalformed, "landmark %zu is not within %.0f m of the origin", i,
                          static_cast<double>(kFarthestMetres));
      }
    }
    if (!(landmark.confidence >= 0.0F && landmark.confidence <= 1.0F)) {
      return make_error(Errc::kMalformed, "the confidence of landmark %zu is not within 0 and 1", i);
    }
  }
  return frame;
}

std::array<std::byte, kDatagramSize> encode(const LandmarkFrame& frame) noexcept {
  std::array<std::byte, kDatagramSize> datagram{};
  for (std::size_t i = 0; i < kMagic.size(); ++i) datagram[i] = static_cast<std::byte>(kMagic[i]);
  store<std::uint16_t>(datagram, 4, kVersion);
  store<std::uint8_t>(datagram, 6, frame.side == Side::kRight ? 0 : 1);
  store<std::uint64_t>(datagram, 8, frame.frame_number);
  store<std::uint64_t>(datagram, 16, static_cast<std::uint64_t>(frame.t_capture_ns));
  for (std::size_t i = 0; i < kLandmarkCount; ++i) {
    const LandmarkFrame::Landmark& landmark = frame.landmarks[i];
    for (std::size_t k = 0; k < 3; ++k) store(datagram, place(i, k), std::bit_cast<std::uint32_t>(landmark.p_W[k]));
    store(datagram, place(i, 3), std::bit_cast<std::uint32_t>(landmark.confidence));
  }
  return datagram;
}

}  // namespace embody::landmarks
