#include "drivers/ur_rtde/primary_codec.hpp"

#include <cmath>

namespace embody::ur {
namespace {

/// Takes values off the front of bytes; after the first one that is missing everything reads as zero.
class Reader {
 public:
  explicit Reader(Bytes bytes) noexcept : rest_(bytes) {}

  template <class T>
  T take() noexcept {
    if (rest_.size() < sizeof(T)) return fail(), T{};
    const T value = rtde::load<T>(rest_, 0);
    rest_ = rest_.subspan(sizeof(T));
    return value;
  }
  template <class T>
  std::array<T, 6> take_six() noexcept {
    std::array<T, 6> values{};
    for (T& value : values) value = take<T>();
    return values;
  }
  std::string_view take_text(std::size_t size) noexcept {
    if (rest_.size() < size) return fail(), std::string_view{};
    const std::string_view text(reinterpret_cast<const char*>(rest_.data()), size);
    rest_ = rest_.subspan(size);
    return text;
  }
  /// What is left, without the zeros and line ends that some firmware appends.
  std::string_view take_rest() noexcept {
    std::string_view text = take_text(rest_.size());
    while (!text.empty() && (text.back() == '\0' || text.back() == '\n')) text.remove_suffix(1);
    return text;
  }
  [[nodiscard]] bool ok() const noexcept { return ok_; }

 private:
  void fail() noexcept {
    ok_ = false;
    rest_ = {};
  }
  Bytes rest_;
  bool ok_{true};
};

bool all_finite(const std::array<double, 6>& values) noexcept {
  for (const double value : values) {
    if (!std::isfinite(value)) return false;
  }
  return true;
}

void take_version(Reader& in, RobotMessage& message) noexcept {
  message.title = in.take_text(in.take<std::uint8_t>());
  message.major = in.take<std::uint8_t>();
  message.minor = in.take<std::uint8_t>();
  message.code = in.take<std::int32_t>();      // bugfix release
  message.argument = in.take<std::int32_t>();  // build
  message.text = in.take_rest();
}

void take_error_code(Reader& in, RobotMessage& message) noexcept {
  message.code = in.take<std::int32_t>();
  message.argument = in.take<std::int32_t>();
  message.level = in.take<std::int32_t>();
  (void)in.take<std::uint32_t>();  // type of the datum
  (void)in.take<std::uint32_t>();  // datum
  message.text = in.take_rest();
}

}  // namespace

PrimaryMessage parse_primary(Bytes bytes) noexcept {
  if (bytes.size() < sizeof(std::uint32_t)) return {};
  const std::size_t size = rtde::load<std::uint32_t>(bytes, 0);
  if (size < kPrimaryHeader || size > kMaxPrimaryMessage) return {PrimaryFraming::kBroken, 0, {}, 0};
  if (bytes.size() < size) return {};
  return {PrimaryFraming::kComplete, rtde::load<std::uint8_t>(bytes, 4),
          bytes.subspan(kPrimaryHeader, size - kPrimaryHeader), size};
}

std::optional<UrKinematics> decode_kinematics(Bytes robot_state) noexcept {
  for (PrimaryMessage part = parse_primary(robot_state); part.framing == PrimaryFraming::kComplete;
       part = parse_primary(robot_state)) {
    robot_state = robot_state.subspan(part.size);
    if (part.type != kKinematicsPart) continue;
    Reader in(part.contents);
    UrKinematics kinematics;
    kinematics.checksum = in.take_six<std::uint32_t>();
    kinematics.theta_rad = in.take_six<double>();
    kinematics.a_m = in.take_six<double>();
    kinematics.d_m = in.take_six<double>();
    kinematics.alpha_rad = in.take_six<double>();
    if (!in.ok()) return std::nullopt;
    kinematics.calibration_status = in.take<std::uint32_t>();  // missing on CB3
    const bool finite = all_finite(kinematics.theta_rad) && all_finite(kinematics.a_m) && all_finite(kinematics.d_m) &&
                        all_finite(kinematics.alpha_rad);
    return finite ? std::optional(kinematics) : std::nullopt;
  }
  return std::nullopt;
}

std::optional<RobotMessage> decode_robot_message(Bytes contents) noexcept {
  Reader in(contents);
  RobotMessage message;
  message.timestamp_us = in.take<std::uint64_t>();
  (void)in.take<std::int8_t>();  // source
  message.kind = in.take<std::uint8_t>();
  switch (static_cast<MessageKind>(message.kind)) {
    case MessageKind::kText:
      message.text = in.take_rest();
      break;
    case MessageKind::kVersion:
      take_version(in, message);
      break;
    case MessageKind::kSafetyMode:
      message.code = in.take<std::int32_t>();
      message.argument = in.take<std::int32_t>();
      break;
    case MessageKind::kErrorCode:
      take_error_code(in, message);
      break;
    case MessageKind::kKey:
      message.code = in.take<std::int32_t>();
      message.argument = in.take<std::int32_t>();
      message.title = in.take_text(in.take<std::uint8_t>());
      message.text = in.take_rest();
      break;
    case MessageKind::kRuntimeException:
      message.line = in.take<std::int32_t>();
      message.column = in.take<std::int32_t>();
      message.text = in.take_rest();
      break;
  }
  return in.ok() ? std::optional(message) : std::nullopt;
}

}  // namespace embody::ur
