#include "drivers/ur_rtde/arm_package.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace embody::rtde {
namespace {

constexpr std::size_t kTimestamp = offset_of(kOutputRecipe, "timestamp", DataType::kDouble);
constexpr std::size_t kActualQ = offset_of(kOutputRecipe, "actual_q", DataType::kVector6d);
constexpr std::size_t kActualQd = offset_of(kOutputRecipe, "actual_qd", DataType::kVector6d);
constexpr std::size_t kTargetQ = offset_of(kOutputRecipe, "target_q", DataType::kVector6d);
constexpr std::size_t kRobotMode = offset_of(kOutputRecipe, "robot_mode", DataType::kInt32);
constexpr std::size_t kSafetyStatus = offset_of(kOutputRecipe, "safety_status", DataType::kInt32);
constexpr std::size_t kRuntimeState = offset_of(kOutputRecipe, "runtime_state", DataType::kUint32);
constexpr std::size_t kSafetyBits = offset_of(kOutputRecipe, "safety_status_bits", DataType::kUint32);
constexpr std::size_t kSpeedScaling = offset_of(kOutputRecipe, "speed_scaling", DataType::kDouble);
constexpr std::size_t kEcho = offset_of(kOutputRecipe, "output_int_register_24", DataType::kInt32);
constexpr std::size_t kProgramState = offset_of(kOutputRecipe, "output_int_register_25", DataType::kInt32);
constexpr std::size_t kProgramFault = offset_of(kOutputRecipe, "output_int_register_26", DataType::kInt32);
constexpr std::size_t kVersion = offset_of(kOutputRecipe, "output_int_register_27", DataType::kInt32);

constexpr std::size_t kSequence = kFieldsStart + offset_of(kInputRecipe, "input_int_register_24", DataType::kInt32);
constexpr std::size_t kMode = kFieldsStart + offset_of(kInputRecipe, "input_int_register_25", DataType::kInt32);
constexpr std::size_t kTarget = kFieldsStart + offset_of(kInputRecipe, "input_double_register_24", DataType::kDouble);
constexpr std::size_t kVelocity = kFieldsStart + offset_of(kInputRecipe, "input_double_register_30", DataType::kDouble);

constexpr std::int32_t kTrackingState = 2;

Vector6 load_vector(Bytes fields, std::size_t offset) noexcept {
  Vector6 vector;
  for (int i = 0; i < 6; ++i) vector[i] = load<double>(fields, offset + sizeof(double) * static_cast<std::size_t>(i));
  return vector;
}

void store_vector(std::span<std::byte> package, std::size_t offset, const Vector6& vector) noexcept {
  for (int i = 0; i < 6; ++i) store(package, offset + sizeof(double) * static_cast<std::size_t>(i), vector[i]);
}

bool is_emergency(const ControllerStatus& status) noexcept {
  constexpr std::uint32_t kBits = 0b0'1110'0000;  // system, robot, any emergency stop
  const int code = status.safety_status;
  return (status.safety_status_bits & kBits) != 0 || code == 6 || code == 7 || code == 15 || code == 16;
}

/// Stops that an operator or an input releases: protective, safeguard, enabling device, PROFIsafe.
bool is_stop(int code) noexcept {
  return code == 3 || code == 5 || (code >= 12 && code <= 14) || (code >= 17 && code <= 20) || code == 22;
}

bool is_fault(const ControllerStatus& status) noexcept {
  constexpr std::uint32_t kBits = 0b11'0000'1000;  // recovery, violation, fault
  const int code = status.safety_status;
  return (status.safety_status_bits & kBits) != 0 || !(code == 1 || code == 2 || is_stop(code));
}

std::int32_t mode_of(ArmAction action) noexcept {
  switch (action) {
    case ArmAction::kTrack:
      return 1;
    case ArmAction::kExit:
      return 9;
    case ArmAction::kHold:
      break;
  }
  return 0;
}

}  // namespace

OutputRecipe::OutputRecipe() noexcept : count_(kOutputRecipe.size() + kOptionalOutputs.size()) {
  std::copy(kOutputRecipe.begin(), kOutputRecipe.end(), variables_.begin());
  std::copy(kOptionalOutputs.begin(), kOptionalOutputs.end(), variables_.begin() + kOutputRecipe.size());
}

bool OutputRecipe::drop_unknown(std::string_view reply_types) noexcept {
  std::string_view token;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const bool unknown = next_token(reply_types, token) && token == "NOT_FOUND" && i >= kOutputRecipe.size();
    if (!unknown) variables_[kept++] = variables_[i];
  }
  return std::exchange(count_, kept) != kept;
}

std::size_t OutputRecipe::offset(std::string_view name) const noexcept {
  std::size_t offset = 0;
  for (const Variable& variable : variables()) {
    if (variable.name == name) return offset;
    offset += wire_size(variable.type);
  }
  return 0;
}

ControllerStatus decode_status(Bytes fields) noexcept {
  return {load<std::int32_t>(fields, kRobotMode),   load<std::int32_t>(fields, kSafetyStatus),
          load<std::uint32_t>(fields, kSafetyBits), load<std::uint32_t>(fields, kRuntimeState),
          load<std::int32_t>(fields, kVersion),     0};
}

ArmCondition arm_condition(const ControllerStatus& status) noexcept {
  constexpr std::uint32_t kStopBits = 0b111'1111'1100;  // b2 (protective stop) to b10 (stopped due to safety)
  if (is_emergency(status)) return ArmCondition::kEmergencyStop;
  if (is_fault(status)) return ArmCondition::kFault;
  if (is_stop(status.safety_status) || (status.safety_status_bits & kStopBits) != 0) {
    return ArmCondition::kProtectiveStop;
  }
  if (status.robot_mode != 7) return ArmCondition::kNotRunning;
  if (status.runtime_state != 2 || status.program_version != kProgramVersion) return ArmCondition::kProgramStopped;
  return ArmCondition::kReady;
}

bool decode_state(Bytes fields, ArmState& state) noexcept {
  constexpr double kLongestUptime = 9e9;  // s: int64 nanoseconds
  const double timestamp_s = load<double>(fields, kTimestamp);
  const Vector6 q_rad = load_vector(fields, kActualQ);
  const Vector6 qd_rad_s = load_vector(fields, kActualQd);
  const Vector6 q_target_rad = load_vector(fields, kTargetQ);
  if (!(std::abs(timestamp_s) < kLongestUptime)) return false;
  if (!q_rad.allFinite() || !qd_rad_s.allFinite() || !q_target_rad.allFinite()) return false;
  state.controller_time = Duration(std::llround(timestamp_s * 1e9));
  state.q_rad = q_rad;
  state.qd_rad_s = qd_rad_s;
  state.q_target_rad = q_target_rad;
  const ControllerStatus status = decode_status(fields);
  state.condition = arm_condition(status);
  state.tracking =
      state.condition == ArmCondition::kReady && load<std::int32_t>(fields, kProgramState) == kTrackingState;
  state.program_fault = load<std::int32_t>(fields, kProgramFault);
  state.echo_sequence = load<std::uint32_t>(fields, kEcho);
  state.robot_mode = status.robot_mode;
  state.safety_status = status.safety_status;
  const double scaling = load<double>(fields, kSpeedScaling);
  state.speed_scaling = std::isfinite(scaling) ? scaling : 0.0;
  return true;
}

void encode_command(const ArmCommand& command, std::uint8_t recipe, CommandPackage& package) noexcept {
  const bool track = command.action == ArmAction::kTrack;
  begin_data(package, recipe);
  store(package, kSequence, static_cast<std::int32_t>(command.sequence & kSequenceMask));
  store(package, kMode, mode_of(command.action));
  store_vector(package, kTarget, track ? command.q_rad : Vector6(Vector6::Zero()));
  store_vector(package, kVelocity, track ? command.qd_rad_s : Vector6(Vector6::Zero()));
}

}  // namespace embody::rtde
