#pragma once
// Big-endian values and typed recipes of the Real-Time Data Exchange (RTDE) interface of Universal Robots.
// Source: Universal Robots, "Real-Time Data Exchange (RTDE) guide", tables of field types.
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace embody::rtde {

using Bytes = std::span<const std::byte>;

namespace detail {
template <class T>
struct WireInteger {
  using Type = std::make_unsigned_t<T>;
};
template <>
struct WireInteger<double> {
  using Type = std::uint64_t;
};
}  // namespace detail

/// Reads a big-endian integer or IEEE-754 double at `offset`. @pre offset + sizeof(T) <= bytes.size()
template <class T>
[[nodiscard]] constexpr T load(Bytes bytes, std::size_t offset) noexcept {
  using Integer = typename detail::WireInteger<T>::Type;
  Integer value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    value = static_cast<Integer>((std::uint64_t{value} << 8U) | std::to_integer<std::uint64_t>(bytes[offset + i]));
  }
  return std::bit_cast<T>(value);
}

/// Writes a big-endian integer or IEEE-754 double at `offset`. @pre offset + sizeof(T) <= bytes.size()
template <class T>
constexpr void store(std::span<std::byte> bytes, std::size_t offset, T value) noexcept {
  auto integer = std::uint64_t{std::bit_cast<typename detail::WireInteger<T>::Type>(value)};
  for (std::size_t i = sizeof(T); i-- > 0; integer >>= 8U) bytes[offset + i] = static_cast<std::byte>(integer & 0xFFU);
}

enum class DataType : std::uint8_t {
  kBool,
  kUint8,
  kUint32,
  kInt32,
  kUint64,
  kDouble,
  kVector3d,
  kVector6d,
  kVector6Int32,
  kVector6Uint32,
};

/// Bytes that a value takes in a data package: packed, no padding.
[[nodiscard]] constexpr std::size_t wire_size(DataType type) noexcept {
  constexpr std::array<std::size_t, 10> kSizes{1, 1, 4, 4, 8, 8, 24, 48, 24, 24};
  return kSizes[static_cast<std::size_t>(type)];
}

/// Token of the type in the reply to a recipe, e.g. "VECTOR6D".
[[nodiscard]] std::string_view type_name(DataType type) noexcept;
[[nodiscard]] std::optional<DataType> parse_type(std::string_view token) noexcept;

struct Variable {
  std::string_view name;
  DataType type{DataType::kDouble};
};

/// Bytes that the fields of a recipe take in a data package, without header and recipe id.
[[nodiscard]] constexpr std::size_t fields_size(std::span<const Variable> recipe) noexcept {
  std::size_t size = 0;
  for (const Variable& variable : recipe) size += wire_size(variable.type);
  return size;
}

/// Where the field `name` starts, counted from the first field. Evaluated by the compiler; an unknown name or another
/// type does not compile.
template <std::size_t N>
[[nodiscard]] consteval std::size_t offset_of(const std::array<Variable, N>& recipe, std::string_view name,
                                              DataType type) {
  std::size_t offset = 0;
  for (const Variable& variable : recipe) {
    if (variable.name == name) return variable.type == type ? offset : throw "the variable has another type";
    offset += wire_size(variable.type);
  }
  throw "the recipe has no such variable";
}

/// "a,b,c": the names of a recipe as a setup request carries them.
[[nodiscard]] std::string join_names(std::span<const Variable> recipe);

/// Takes the next element of a comma-separated list off `list`; false at its end. A trailing comma adds no element.
[[nodiscard]] bool next_token(std::string_view& list, std::string_view& token) noexcept;

}  // namespace embody::rtde
