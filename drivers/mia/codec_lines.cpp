// The hand's lines, as the host reads them.
#include "drivers/mia/codec_fields.hpp"

namespace embody::mia {

using namespace fields;  // NOLINT(google-build-using-namespace): the codec's own parts

namespace {

/// Fields of `period` bytes: a sign, then digits of which the last `used` carry the value.
template <std::size_t N>
std::optional<std::array<int, N>> parse_fields(std::string_view line, std::size_t first, std::size_t period,
                                               std::size_t width, std::size_t used) noexcept {
  std::array<int, N> values{};
  for (std::size_t i = 0; i < N; ++i) {
    const std::size_t offset = first + i * period;
    const auto value = with_sign(line[offset], digits(line.substr(offset + 1 + width - used, used)));
    if (!value) return std::nullopt;
    values[i] = *value;
  }
  return values;
}

template <class T>
std::array<T, kMotors> in_motor_order(const std::array<int, kMotors>& line_fields, T unit) noexcept {
  std::array<T, kMotors> values{};
  for (std::size_t i = 0; i < kMotors; ++i) values[i] = static_cast<T>(line_fields[kFieldOfMotor[i]]) * unit;
  return values;
}

}  // namespace

bool is_acknowledgement(std::string_view line) noexcept {
  return !tail(line, kAckSize, "<").empty();
}

bool acknowledges(std::string_view line, const Command& command) noexcept {
  const std::string_view ack = tail(line, kAckSize, "<");
  return !ack.empty() && ack.substr(1, kPayloadSize - 1) == payload_of(command).substr(0, kPayloadSize - 1);
}

std::optional<std::array<int, kMotors>> parse_triple(std::string_view line, TripleLine kind) noexcept {
  const char tag = static_cast<char>(kind);
  const std::string_view text = tail(line, kTripleSize, {&tag, 1});
  if (text.empty()) return std::nullopt;
  const std::size_t used = kind == TripleLine::kPosition ? 3 : kind == TripleLine::kSpeed ? 2 : 4;
  const auto values = parse_fields<kMotors>(text, kFirstField, kFieldPeriod, kFieldDigits, used);
  if (!values) return std::nullopt;
  return in_motor_order(*values, 1);
}

std::optional<std::array<double, kMotors>> parse_joint_positions(std::string_view line) noexcept {
  const std::string_view text = tail(line, kJointPositionSize, "JP");
  if (text.empty()) return std::nullopt;
  const auto values = parse_fields<kMotors>(text, 2, 4, 3, 3);
  if (!values) return std::nullopt;
  return in_motor_order(*values, 0.01);
}

std::optional<std::array<double, kMotors>> parse_joint_speeds(std::string_view line) noexcept {
  const std::string_view text = tail(line, kJointSpeedSize, "JS");
  if (text.empty()) return std::nullopt;
  const auto values = parse_fields<kMotors>(text, 2, 3, 2, 2);
  if (!values) return std::nullopt;
  return in_motor_order(*values, 0.1);
}

std::optional<std::array<int, kStrainFields>> parse_strain_gauges(std::string_view line) noexcept {
  const std::string_view text = tail(line, kStrainSize, "a");
  if (text.empty()) return std::nullopt;
  return parse_fields<kStrainFields>(text, kFirstField, kFieldPeriod, kFieldDigits, 4);
}

std::optional<std::string_view> parse_firmware_id(std::string_view line) noexcept {
  for (const std::size_t size : {kLongFirmwareSize, kShortFirmwareSize}) {
    const std::string_view text = tail(line, size, "F");
    if (!text.empty()) return text.substr(0, size - 1);
  }
  return std::nullopt;
}

bool LineAssembler::push(char byte) noexcept {
  if (complete_) size_ = 0;
  if (size_ == kCapacity) {
    std::copy(buffer_.end() - kMaxLine, buffer_.end(), buffer_.begin());
    size_ = kMaxLine;
    ++overflows_;
  }
  buffer_[size_++] = byte;
  complete_ = byte == '\n';
  return complete_;
}

}  // namespace embody::mia
