#pragma once
// Unsigned integers to and from bytes in either byte order. QTM's port decides the order of a whole connection.
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace embody::qualisys {

enum class ByteOrder : std::uint8_t {
  kLittle,  ///< QTM's base port plus 1 (22223)
  kBig,     ///< QTM's base port plus 2 (22224)
};
inline constexpr const char* kByteOrderNames[] = {"little", "big"};

/// How far byte `i` of an integer of `size` bytes is shifted.
[[nodiscard]] constexpr unsigned shift_of(std::size_t i, std::size_t size, ByteOrder order) noexcept {
  return static_cast<unsigned>(8 * (order == ByteOrder::kLittle ? i : size - 1 - i));
}

/// @pre offset + sizeof(T) <= bytes.size()
template <std::unsigned_integral T>
[[nodiscard]] constexpr T load(std::span<const std::byte> bytes, std::size_t offset, ByteOrder order) noexcept {
  T value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    const auto byte = static_cast<T>(std::to_integer<std::uint8_t>(bytes[offset + i]));
    value = static_cast<T>(value | static_cast<T>(byte << shift_of(i, sizeof(T), order)));
  }
  return value;
}

template <std::unsigned_integral T>
void append(std::vector<std::byte>& bytes, T value, ByteOrder order) {
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    bytes.push_back(static_cast<std::byte>((value >> shift_of(i, sizeof(T), order)) & 0xFF));
  }
}

}  // namespace embody::qualisys
