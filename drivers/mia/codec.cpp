#include "drivers/mia/codec.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace embody::mia {
namespace {

// Digits that name the motors on the wire, in the order of Motor: the index is '3', MRL is '2'.
constexpr std::array<char, kMotors> kMotorDigit{'1', '3', '2'};
// Place of each motor's field in a three-field line, which comes as thumb, MRL, index.
constexpr std::array<std::size_t, kMotors> kFieldOfMotor{0, 2, 1};

// Lines with a tag of one byte: five bytes of unknown content, then fields of sign and five digits, nine bytes apart.
constexpr std::size_t kTripleSize = 31;
constexpr std::size_t kStrainSize = 76;
constexpr std::size_t kFirstField = 6;
constexpr std::size_t kFieldPeriod = 9;
constexpr std::size_t kFieldDigits = 5;
constexpr std::size_t kJointPositionSize = 15;
constexpr std::size_t kJointSpeedSize = 12;
constexpr std::size_t kShortFirmwareSize = 10;
constexpr std::size_t kLongFirmwareSize = 28;

constexpr std::size_t at(Motor motor) noexcept {
  return static_cast<std::size_t>(motor);
}

/// Writes |value| right-aligned with leading zeros; higher digits are cut.
void put_digits(char* to, std::size_t count, int value) noexcept {
  int rest = std::abs(value);
  for (std::size_t i = count; i-- > 0; rest /= 10) to[i] = static_cast<char>('0' + rest % 10);
}

char sign_of(int value) noexcept {
  return value < 0 ? '-' : '+';
}

std::optional<int> digits(std::string_view text) noexcept {
  int value = 0;
  for (const char c : text) {
    if (c < '0' || c > '9') return std::nullopt;
    value = value * 10 + (c - '0');
  }
  return value;
}

std::optional<int> with_sign(char sign, std::optional<int> magnitude) noexcept {
  if (!magnitude || (sign != '+' && sign != '-')) return std::nullopt;
  return sign == '-' ? -*magnitude : *magnitude;
}

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
std::array<T, kMotors> in_motor_order(const std::array<int, kMotors>& fields, T unit) noexcept {
  std::array<T, kMotors> values{};
  for (std::size_t i = 0; i < kMotors; ++i) values[i] = static_cast<T>(fields[kFieldOfMotor[i]]) * unit;
  return values;
}

/// The last `size` bytes of a line that ends with LF and carries `tag` there, or an empty view.
std::string_view tail(std::string_view line, std::size_t size, std::string_view tag) noexcept {
  if (line.size() < size || line.back() != '\n') return {};
  const std::string_view last = line.substr(line.size() - size);
  return last.substr(0, tag.size()) == tag ? last : std::string_view{};
}

DataLine blank_line(std::size_t size, std::string_view tag) noexcept {
  DataLine line;
  line.size = size;
  std::fill_n(line.bytes.begin(), size, '.');
  std::copy(tag.begin(), tag.end(), line.bytes.begin());
  line.bytes[size - 1] = '\n';
  return line;
}

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
  std::array<int, kMotors> fields{};
  for (std::size_t i = 0; i < kMotors; ++i) fields[kFieldOfMotor[i]] = values[i];
  return fields;
}

/// Rounds to an integer within ±limit; not-a-number becomes zero.
int rounded(double value, int limit) noexcept {
  if (std::isnan(value)) return 0;
  return static_cast<int>(std::lround(std::clamp(value, -1.0 * limit, 1.0 * limit)));
}

std::array<int, kMotors> rounded_fields(const std::array<double, kMotors>& values, double per_unit,
                                        int limit) noexcept {
  std::array<int, kMotors> result{};
  for (std::size_t i = 0; i < kMotors; ++i) result[i] = rounded(values[i] * per_unit, limit);
  return in_field_order(result);
}

std::optional<Motor> motor_of(char digit) noexcept {
  for (std::size_t i = 0; i < kMotors; ++i) {
    if (kMotorDigit[i] == digit) return static_cast<Motor>(i);
  }
  return std::nullopt;
}

std::string_view payload_of(const Command& command) noexcept {
  return {command.data() + 1, kPayloadSize};
}

/// True when `payload` is `text` followed by padding only.
bool is_plain(std::string_view payload, std::string_view text) noexcept {
  return payload.substr(0, text.size()) == text &&
         payload.substr(text.size()).find_first_not_of('.') == std::string_view::npos;
}

int lower_limit(Motor motor) noexcept {
  return motor == Motor::kIndex ? -1 : 0;
}

/// "mPs0dddvv", "mSs....vvcc", "JmPsdddvv" (positions in the payload, which starts behind '@').
Request parse_motion(std::string_view payload) noexcept {
  const bool joint = payload[0] == 'J';
  const std::string_view text = payload.substr(joint ? 1 : 0);
  const auto motor = motor_of(text[0]);
  if (!motor) return {};
  Request request;
  request.motor = *motor;
  std::optional<int> value, speed, current{0};
  if (text[1] == 'S' && !joint) {
    request.kind = Request::Kind::kMotorSpeed;
    value = with_sign(text[2], digits(text.substr(7, 2)));
    speed = digits(text.substr(7, 2));
    current = digits(text.substr(9, 2));
  } else if (text[1] == 'P') {
    request.kind = joint ? Request::Kind::kJointPosition : Request::Kind::kMotorPosition;
    value = with_sign(text[2], digits(text.substr(joint ? 3 : 4, 3)));
    speed = digits(text.substr(joint ? 6 : 7, 2));
  }
  if (!value || !speed || !current) return {};
  request.value = *value;
  request.speed_percent = *speed;
  request.current_percent = *current;
  return request;
}

Request parse_channel(std::string_view payload) noexcept {
  if (is_plain(payload, "Ad")) return {.kind = Request::Kind::kStopStreams};
  const char channel = payload[2];
  const char what = payload[3];
  if (!is_plain(payload.substr(4), "")) return {};
  if (what == 'o' && std::string_view("PSACJj").find(channel) != std::string_view::npos) {
    return {.kind = Request::Kind::kRead, .channel = channel};
  }
  if ((what == '0' || what == '1') && std::string_view("PSAC").find(channel) != std::string_view::npos) {
    return {.kind = Request::Kind::kStream, .channel = channel, .on = what == '1'};
  }
  return {};
}

}  // namespace

Command encode_plain(std::string_view payload) noexcept {
  Command command;
  command.fill('.');
  command[0] = '@';
  std::copy_n(payload.begin(), std::min(payload.size(), kPayloadSize), command.begin() + 1);
  command[16] = '*';
  command[17] = '\r';
  return command;
}

Command encode_motor_position(Motor motor, int counts, int speed_percent) noexcept {
  const int limited = std::clamp(counts, lower_limit(motor) * kMaxCounts, kMaxCounts);
  Command command = encode_plain({});
  command[1] = kMotorDigit[at(motor)];
  command[2] = 'P';
  command[3] = sign_of(limited);
  put_digits(&command[4], 4, limited);
  put_digits(&command[8], 2, std::clamp(speed_percent, 0, 99));
  return command;
}

Command encode_motor_speed(Motor motor, int speed, int current_percent) noexcept {
  const int limited = std::clamp(speed, -99, 99);
  Command command = encode_plain({});
  command[1] = kMotorDigit[at(motor)];
  command[2] = 'S';
  command[3] = sign_of(limited);
  put_digits(&command[8], 2, limited);
  put_digits(&command[10], 2, std::clamp(current_percent, 0, 80));
  return command;
}

Command encode_joint_position(Motor motor, double angle_rad, int speed_percent) noexcept {
  const int hundredths = std::max(rounded(angle_rad * 100.0, 300), lower_limit(motor) * 300);
  Command command = encode_plain({});
  command[1] = 'J';
  command[2] = kMotorDigit[at(motor)];
  command[3] = 'P';
  command[4] = sign_of(hundredths);
  put_digits(&command[5], 3, hundredths);
  put_digits(&command[8], 2, std::clamp(speed_percent, 0, 99));
  return command;
}

bool acknowledges(std::string_view line, const Command& command) noexcept {
  const std::string_view ack = tail(line, kAckSize, "<");
  return !ack.empty() && ack.substr(1, 14) == payload_of(command).substr(0, 14);
}

std::optional<std::array<int, kMotors>> parse_triple(std::string_view line, TripleLine kind) noexcept {
  const char tag = static_cast<char>(kind);
  const std::string_view text = tail(line, kTripleSize, {&tag, 1});
  if (text.empty()) return std::nullopt;
  const std::size_t used = kind == TripleLine::kPosition ? 3 : kind == TripleLine::kSpeed ? 2 : 4;
  const auto fields = parse_fields<kMotors>(text, kFirstField, kFieldPeriod, kFieldDigits, used);
  if (!fields) return std::nullopt;
  return in_motor_order(*fields, 1);
}

std::optional<std::array<double, kMotors>> parse_joint_positions(std::string_view line) noexcept {
  const std::string_view text = tail(line, kJointPositionSize, "JP");
  if (text.empty()) return std::nullopt;
  const auto fields = parse_fields<kMotors>(text, 2, 4, 3, 3);
  if (!fields) return std::nullopt;
  return in_motor_order(*fields, 0.01);
}

std::optional<std::array<double, kMotors>> parse_joint_speeds(std::string_view line) noexcept {
  const std::string_view text = tail(line, kJointSpeedSize, "JS");
  if (text.empty()) return std::nullopt;
  const auto fields = parse_fields<kMotors>(text, 2, 3, 2, 2);
  if (!fields) return std::nullopt;
  return in_motor_order(*fields, 0.1);
}

std::optional<std::array<int, 8>> parse_strain_gauges(std::string_view line) noexcept {
  const std::string_view text = tail(line, kStrainSize, "a");
  if (text.empty()) return std::nullopt;
  return parse_fields<8>(text, kFirstField, kFieldPeriod, kFieldDigits, 4);
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

Request parse_command(const Command& command) noexcept {
  const std::string_view payload = payload_of(command);
  if (payload[0] == 'J' || (payload[0] >= '1' && payload[0] <= '3')) return parse_motion(payload);
  if (is_plain(payload, kStopAllPayload)) return {.kind = Request::Kind::kStopAll};
  if (is_plain(payload, kFirmwareIdPayload)) return {.kind = Request::Kind::kFirmwareId};
  if (payload.substr(0, 2) == "AD" || payload.substr(0, 2) == "Ad") return parse_channel(payload);
  return {};
}

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

DataLine encode_strain_gauges(const std::array<int, 8>& values) noexcept {
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
