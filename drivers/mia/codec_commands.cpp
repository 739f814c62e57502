// The host's commands.
#include "drivers/mia/codec_fields.hpp"

namespace embody::mia {

using namespace fields;  // NOLINT(google-build-using-namespace): the codec's own parts

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

Command encode_finger_force(Motor motor, int force_percent, int current_percent) noexcept {
  Command command = encode_plain({});
  command[1] = kMotorDigit[at(motor)];
  command[2] = 'F';
  command[3] = '+';
  put_digits(&command[8], 2, std::clamp(force_percent, 0, 99));
  put_digits(&command[10], 2, std::clamp(current_percent, 0, 80));
  return command;
}

int joint_hundredths(Motor motor, double angle_rad) noexcept {
  return std::max(rounded(angle_rad * 100.0, 300), lower_limit(motor) * 300);
}

Command encode_joint_position(Motor motor, double angle_rad, int speed_percent) noexcept {
  const int hundredths = joint_hundredths(motor, angle_rad);
  Command command = encode_plain("J");
  command[2] = kMotorDigit[at(motor)];
  command[3] = 'P';
  command[4] = sign_of(hundredths);
  put_digits(&command[5], 3, hundredths);
  put_digits(&command[8], 2, std::clamp(speed_percent, 0, 99));
  return command;
}

Command encode_joint_speed(Motor motor, double speed_rad_s, int current_percent) noexcept {
  const int tenths = rounded(speed_rad_s * 10.0, 99);
  Command command = encode_plain("J");
  command[2] = kMotorDigit[at(motor)];
  command[3] = 'S';
  command[4] = sign_of(tenths);
  put_digits(&command[5], 2, tenths);
  put_digits(&command[7], 2, std::clamp(current_percent, 0, 80));
  return command;
}

Command encode_read(char channel) noexcept {
  const std::array<char, 4> text{'A', 'D', channel, 'o'};
  return encode_plain({text.data(), text.size()});
}

Command encode_stream(char channel, bool on) noexcept {
  const std::array<char, 4> text{'A', 'D', channel, on ? '1' : '0'};
  return encode_plain({text.data(), text.size()});
}

}  // namespace embody::mia
