// The hand's end of the protocol: its ACKs and data lines, and how it finds commands in the bytes.
#include "drivers/mia/codec_fields.hpp"

namespace embody::mia {

using namespace fields;  // NOLINT(google-build-using-namespace): the codec's own parts

namespace {

template <std::size_t N>
void put_fields(DataLine& line, std::size_t first, std::size_t period, std::size_t width,
                const std::array<int, N>& values) noexcept {
  for (std::size_t i = 0; i < N; ++i) {
    char* field = line.bytes.data() + first + i * period;
    field[0] = sign_of(values[i]);
    put_digits(field + 1, width, std::clamp(values[i], -99'999, 99'999));
  }
}

std::array<int, kMotors> in_field_order(const std::array<int, kMotors>& values) noexcept {
  std::array<int, kMotors> result{};
  for (std::size_t i = 0; i < kMotors; ++i) result[kFieldOfMotor[i]] = values[i];
  return result;
}

std::array<int, kMotors> rounded_fields(const std::array<double, kMotors>& values, double per_unit,
                                        int limit) noexcept {
  std::array<int, kMotors> result{};
  for (std::size_t i = 0; i < kMotors; ++i) result[i] = rounded(values[i] * per_unit, limit);
  return in_field_order(result);
}

}  // namespace

Ack encode_ack(const Command& command) noexcept {
  Ack ack{};
  ack[0] = '<';
  std::copy_n(command.begin() + 1, kPayloadSize, ack.begin() + 1);
  ack[16] = '\n';
  return ack;
}

DataLine encode_triple(TripleLine kind, const std::array<int, kMotors>& values) noexcept {
  const char tag = static_cast<char>(kind);
  DataLine line = blank_line(kTripleSize, {&tag, 1});
  put_fields(line, kFirstField, kFieldPeriod, kFieldDigits, in_field_order(values));
  return line;
}

DataLine encode_joint_positions(const std::array<double, kMotors>& q_rad) noexcept {
  DataLine line = blank_line(kJointPositionSize, "JP");
  put_fields(line, 2, 4, 3, rounded_fields(q_rad, 100.0, 999));
  return line;
}

DataLine encode_joint_speeds(const std::array<double, kMotors>& qd_rad_s) noexcept {
  DataLine line = blank_line(kJointSpeedSize, "JS");
  put_fields(line, 2, 3, 2, rounded_fields(qd_rad_s, 10.0, 99));
  return line;
}

DataLine encode_strain_gauges(const std::array<int, kStrainFields>& values) noexcept {
  DataLine line = blank_line(kStrainSize, "a");
  put_fields(line, kFirstField, kFieldPeriod, kFieldDigits, values);
  return line;
}

DataLine encode_firmware_id(std::string_view text) noexcept {
  DataLine line = blank_line(kShortFirmwareSize, "F");
  std::copy_n(text.begin(), std::min(text.size(), kShortFirmwareSize - 2), line.bytes.begin() + 1);
  return line;
}

std::optional<Command> CommandAssembler::push(char byte) noexcept {
  buffer_[size_++] = byte;
  while (!fits()) drop_to_next_start();
  if (size_ < kCommandSize) return std::nullopt;
  size_ = 0;
  return buffer_;
}

bool CommandAssembler::fits() const noexcept {
  return (size_ < 1 || buffer_[0] == '@') && (size_ < 17 || buffer_[16] == '*') && (size_ < 18 || buffer_[17] == '\r');
}

void CommandAssembler::drop_to_next_start() noexcept {
  const auto begin = buffer_.begin();
  const auto end = begin + static_cast<std::ptrdiff_t>(size_);
  const auto start = std::find(begin + 1, end, '@');
  skipped_ += static_cast<std::uint64_t>(start - begin);
  std::copy(start, end, begin);
  size_ = static_cast<std::size_t>(end - start);
}

}  // namespace embody::mia
