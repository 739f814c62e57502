#pragma once
// The landmark datagram (docs/landmarks.md): pure functions over bytes.
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/result.hpp"
#include "core/hal/types.hpp"

namespace embody::landmarks {

inline constexpr std::size_t kLandmarkCount = 21;
inline constexpr std::array<char, 4> kMagic{'E', 'M', 'L', 'M'};
inline constexpr std::uint16_t kVersion = 1;
inline constexpr std::size_t kHeaderSize = 24;
/// magic, version u16, side u8, zero u8, frame u64, time i64, then 21 x (x, y, z, confidence) f32; little-endian.
inline constexpr std::size_t kDatagramSize = kHeaderSize + kLandmarkCount * 4 * sizeof(float);
inline constexpr float kFarthestMetres = 10.0F;

/// One frame of a hand tracker. Position m in the tracker's world; confidence 0 (not seen) to 1.
struct LandmarkFrame {
  struct Landmark {
    std::array<float, 3> p_W{};
    float confidence{0.0F};
  };
  Side side{Side::kRight};
  std::uint64_t frame_number{0};
  std::int64_t t_capture_ns{0};  ///< CLOCK_REALTIME; 0: not known
  std::array<Landmark, kLandmarkCount> landmarks{};
};

/// Exactly one datagram. Errors: kMalformed (size, magic, reserved byte, side, time, a number that is not finite or out
/// of range), kUnsupported (version).
[[nodiscard]] Result<LandmarkFrame> decode(std::span<const std::byte> datagram) noexcept;

[[nodiscard]] std::array<std::byte, kDatagramSize> encode(const LandmarkFrame& frame) noexcept;

}  // namespace embody::landmarks
