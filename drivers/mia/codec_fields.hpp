#pragma once
// Digits and fields of the Mia protocol: shared by both ends of codec.hpp, not meant for anybody else.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <string_view>

#include "drivers/mia/codec.hpp"

namespace embody::mia::fields {

// Digits that name the motors on the wire, in the order of Motor: the index is '3', MRL is '2'.
inline constexpr std::array<char, kMotors> kMotorDigit{'1', '3', '2'};
// Place of each motor's field in a three-field line, which comes as thumb, MRL, index.
inline constexpr std::array<std::size_t, kMotors> kFieldOfMotor{0, 2, 1};

// Lines with a tag of one byte: five bytes of unknown content, then fields of sign and five digits, nine bytes apart.
inline constexpr std::size_t kTripleSize = 31;
inline constexpr std::size_t kStrainSize = 76;
inline constexpr std::size_t kFirstField = 6;
inline constexpr std::size_t kFieldPeriod = 9;
inline constexpr std::size_t kFieldDigits = 5;
inline constexpr std::size_t kJointPositionSize = 15;
inline constexpr std::size_t kJointSpeedSize = 12;
inline constexpr std::size_t kShortFirmwareSize = 10;
inline constexpr std::size_t kLongFirmwareSize = 28;

constexpr std::size_t at(Motor motor) noexcept {
  return static_cast<std::size_t>(motor);
}

constexpr int lower_limit(Motor motor) noexcept {
  return motor == Motor::kIndex ? -1 : 0;
}

constexpr char sign_of(int value) noexcept {
  return value < 0 ? '-' : '+';
}

/// Writes |value| right-aligned with leading zeros; higher digits are cut.
inline void put_digits(char* to, std::size_t count, int value) noexcept {
  int rest = std::abs(value);
  for (std::size_t i = count; i-- > 0; rest /= 10) to[i] = static_cast<char>('0' + rest % 10);
}

/// A number without a sign; nothing when a byte is no digit. @pre at most nine bytes
inline std::optional<int> digits(std::string_view text) noexcept {
  int value = 0;
  for (const char c : text) {
    if (c < '0' || c > '9') return std::nullopt;
    value = value * 10 + (c - '0');
  }
  return value;
}

inline std::optional<int> with_sign(char sign, std::optional<int> magnitude) noexcept {
  if (!magnitude || (sign != '+' && sign != '-')) return std::nullopt;
  return sign == '-' ? -*magnitude : *magnitude;
}

/// The last `size` bytes of a line that ends with LF and carries `tag` there, or an empty view.
inline std::string_view tail(std::string_view line, std::size_t size, std::string_view tag) noexcept {
  if (line.size() < size || line.back() != '\n') return {};
  const std::string_view last = line.substr(line.size() - size);
  return last.substr(0, tag.size()) == tag ? last : std::string_view{};
}

inline DataLine blank_line(std::size_t size, std::string_view tag) noexcept {
  DataLine line;
  line.size = size;
  std::fill_n(line.bytes.begin(), size, '.');
  std::copy(tag.begin(), tag.end(), line.bytes.begin());
  line.bytes[size - 1] = '\n';
  return line;
}

/// Rounds to an integer within ±limit; not-a-number becomes zero.
inline int rounded(double value, int limit) noexcept {
  if (std::isnan(value)) return 0;
  return static_cast<int>(std::lround(std::clamp(value, -1.0 * limit, 1.0 * limit)));
}

inline std::optional<Motor> motor_of(char digit) noexcept {
  for (std::size_t i = 0; i < kMotors; ++i) {
    if (kMotorDigit[i] == digit) return static_cast<Motor>(i);
  }
  return std::nullopt;
}

inline std::string_view payload_of(const Command& command) noexcept {
  return {command.data() + 1, kPayloadSize};
}

/// True when `payload` is `text` followed by padding only.
inline bool is_plain(std::string_view payload, std::string_view text) noexcept {
  return payload.substr(0, text.size()) == text &&
         payload.substr(text.size()).find_first_not_of('.') == std::string_view::npos;
}

}  // namespace embody::mia::fields
