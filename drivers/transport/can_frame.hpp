#pragma once
// A classic CAN frame as a plain value: what the codecs of CAN profiles read and write.
#include <array>
#include <cstdint>
#include <span>

#include "core/base/time.hpp"

namespace embody::transport {

/// An identifier of 11 bits, or of 29 when `extended`.
struct CanId {
  std::uint32_t value{0};
  bool extended{false};

  [[nodiscard]] constexpr bool valid() const noexcept { return value <= (extended ? 0x1fffffffu : 0x7ffu); }
  friend constexpr bool operator==(const CanId&, const CanId&) = default;
};

struct CanFrame {
  CanId id;
  std::uint8_t size{0};  ///< data bytes, 0..8
  std::array<std::uint8_t, 8> data{};
  TimePoint t_arrival{};  ///< of a received frame: when the kernel had it, or when it was read where the kernel is mute

  [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept { return {data.data(), size}; }
};

}  // namespace embody::transport
