// What a command asks of the hand.
#include "drivers/mia/codec_fields.hpp"

namespace embody::mia {

using namespace fields;  // NOLINT(google-build-using-namespace): the codec's own parts

namespace {

bool is_grasp(char id) noexcept {
  return std::string_view("CPLUDSTR").find(id) != std::string_view::npos;
}

Request motion(Request::Kind kind, Motor motor, std::optional<int> value, std::optional<int> speed_percent,
               std::optional<int> current_percent) noexcept {
  if (!value || !speed_percent || !current_percent) return {};
  return {.kind = kind,
          .motor = motor,
          .value = *value,
          .speed_percent = *speed_percent,
          .current_percent = *current_percent};
}

/// "mPs0dddvv", "mSs....vvcc", "mF+....ffcc", "mGg...", "mgg" (in the payload, which starts behind '@').
Request parse_motor(std::string_view text) noexcept {
  using Kind = Request::Kind;
  const auto motor = motor_of(text[0]);
  if (!motor) return {};
  switch (text[1]) {
    case 'P':
      return motion(Kind::kMotorPosition, *motor, with_sign(text[2], digits(text.substr(4, 3))),
                    digits(text.substr(7, 2)), 0);
    case 'S':
      return motion(Kind::kMotorSpeed, *motor, with_sign(text[2], digits(text.substr(7, 2))), digits(text.substr(7, 2)),
                    digits(text.substr(9, 2)));
    case 'F':
      return motion(Kind::kFingerForce, *motor, with_sign(text[2], digits(text.substr(7, 2))), 0,
                    digits(text.substr(9, 2)));
    case 'G':
    case 'g':
      if (!is_grasp(text[2])) return {};
      return {.kind = text[1] == 'G' ? Kind::kSetGraspReferences : Kind::kGetGraspReferences,
              .motor = *motor,
              .grasp = text[2]};
    default:
      return {};
  }
}

/// "JmPsdddvv", "JmSsddcc".
Request parse_joint(std::string_view payload) noexcept {
  const std::string_view text = payload.substr(1);
  const auto motor = motor_of(text[0]);
  if (!motor) return {};
  if (text[1] == 'P') {
    return motion(Request::Kind::kJointPosition, *motor, with_sign(text[2], digits(text.substr(3, 3))),
                  digits(text.substr(6, 2)), 0);
  }
  if (text[1] == 'S') {
    return motion(Request::Kind::kJointSpeed, *motor, with_sign(text[2], digits(text.substr(3, 2))), 0,
                  digits(text.substr(5, 2)));
  }
  return {};
}

Request parse_channel(std::string_view payload) noexcept {
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

/// "AGegcccsss" (id, closure, speed in three digits each) or the older "AGgXcccvv".
Request parse_grasp(std::string_view payload) noexcept {
  const bool older = payload[2] != 'e';
  if (older && std::string_view("aAM").find(payload[3]) == std::string_view::npos) return {};
  const char id = older ? payload[2] : payload[3];
  const auto closure = digits(payload.substr(4, 3));
  const auto speed = digits(payload.substr(7, older ? 2 : 3));
  if (!is_grasp(id) || !closure || !speed || *closure > 100 || *speed > 100) return {};
  const bool opens = older && payload[3] == 'a';
  return {
      .kind = Request::Kind::kGrasp, .value = opens ? 0 : *closure, .speed_percent = std::min(*speed, 99), .grasp = id};
}

}  // namespace

Request parse_command(const Command& command) noexcept {
  const std::string_view payload = payload_of(command);
  if (payload[0] >= '1' && payload[0] <= '3') return parse_motor(payload);
  if (payload[0] == 'J') return parse_joint(payload);
  if (is_plain(payload, kStopAllPayload)) return {.kind = Request::Kind::kStopAll};
  if (is_plain(payload, kFirmwareIdPayload)) return {.kind = Request::Kind::kFirmwareId};
  if (is_plain(payload, kCalibratePayload)) return {.kind = Request::Kind::kCalibrate};
  if (is_plain(payload, "ES")) return {.kind = Request::Kind::kStore};
  if (is_plain(payload, "Ad")) return {.kind = Request::Kind::kStopStreams};
  if (payload.substr(0, 2) == "AD") return parse_channel(payload);
  if (payload.substr(0, 2) == "AG") return parse_grasp(payload);
  return {};
}

}  // namespace embody::mia
