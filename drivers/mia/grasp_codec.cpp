#include "drivers/mia/grasp_codec.hpp"

#include "drivers/mia/codec_fields.hpp"

namespace embody::mia {

using namespace fields;  // NOLINT(google-build-using-namespace): the codec's own parts

namespace {

constexpr std::size_t kReferenceLineSize = 29;
constexpr std::array<std::size_t, 3> kReferenceField{10, 17, 24};  ///< signs; three digits follow each

std::optional<int> signed_field(std::string_view text, std::size_t offset) noexcept {
  return with_sign(text[offset], digits(text.substr(offset + 1, 3)));
}

void put_signed(char* to, int value) noexcept {
  to[0] = sign_of(value);
  put_digits(to + 1, 3, value);
}

Command references_command(Motor motor, char kind, char id) noexcept {
  Command command = encode_plain({});
  command[1] = kMotorDigit[at(motor)];
  command[2] = kind;
  command[3] = id;
  return command;
}

}  // namespace

Command encode_old_grasp(char id, OldGraspAction action, int closure_percent, int speed_percent) noexcept {
  Command command = encode_plain("AG");
  command[3] = id;
  command[4] = static_cast<char>(action);
  put_digits(&command[5], 3, std::clamp(closure_percent, 0, 100));
  put_digits(&command[8], 2, std::clamp(speed_percent, 0, 99));
  return command;
}

Command encode_grasp(char id, int closure_percent, int speed_percent) noexcept {
  Command command = encode_plain("AGe");
  command[4] = id;
  put_digits(&command[5], 3, std::clamp(closure_percent, 0, 100));
  put_digits(&command[8], 3, std::clamp(speed_percent, 0, 100));
  return command;
}

Command encode_old_grasp_references(Motor motor, char id, int rest, int closed, int delay) noexcept {
  Command command = references_command(motor, 'G', id);
  put_signed(&command[4], std::clamp(rest, 0, kMaxCounts));
  put_signed(&command[8], std::clamp(closed, 0, kMaxCounts));
  put_signed(&command[12], std::clamp(delay, 0, 100));
  return command;
}

Command encode_grasp_references(Motor motor, char id, int open, int closed) noexcept {
  const int lowest = lower_limit(motor) * kMaxCounts;
  Command command = references_command(motor, 'G', id);
  put_signed(&command[4], std::clamp(open, lowest, kMaxCounts));
  put_signed(&command[8], std::clamp(closed, lowest, kMaxCounts));
  return command;
}

Command encode_get_grasp_references(Motor motor, char id) noexcept {
  return references_command(motor, 'g', id);
}

std::optional<GraspReferences> parse_grasp_references(std::string_view line) noexcept {
  const std::string_view text = tail(line, kReferenceLineSize, "G");
  if (text.empty()) return std::nullopt;
  const auto open = signed_field(text, kReferenceField[0]);
  const auto closed = signed_field(text, kReferenceField[1]);
  const auto delay = signed_field(text, kReferenceField[2]);
  if (!open || !closed || !delay) return std::nullopt;
  return GraspReferences{*open, *closed, *delay};
}

DataLine encode_grasp_reference_line(const GraspReferences& references) noexcept {
  DataLine line = blank_line(kReferenceLineSize, "G");
  put_signed(&line.bytes[kReferenceField[0]], references.open);
  put_signed(&line.bytes[kReferenceField[1]], references.closed);
  put_signed(&line.bytes[kReferenceField[2]], references.delay);
  return line;
}

std::optional<GraspReferences> parse_set_references(const Command& command) noexcept {
  if (parse_command(command).kind != Request::Kind::kSetGraspReferences) return std::nullopt;
  const std::string_view payload = payload_of(command);
  const auto open = signed_field(payload, 3);
  const auto closed = signed_field(payload, 7);
  if (!open || !closed) return std::nullopt;
  if (payload[11] == '.') return GraspReferences{*open, *closed, 0};
  const auto delay = signed_field(payload, 11);
  if (!delay) return std::nullopt;
  return GraspReferences{*open, *closed, *delay};
}

}  // namespace embody::mia
