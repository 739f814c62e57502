#pragma once
// The two recipes of the arm driver and what they mean: RTDE fields to ArmState, ArmCommand to RTDE fields.
#include "core/hal/types.hpp"
#include "drivers/ur_rtde/codec.hpp"

namespace embody::rtde {

/// What every supported firmware has: 260 bytes per package.
inline constexpr std::array<Variable, 17> kOutputRecipe{{
    {"timestamp", DataType::kDouble},
    {"actual_q", DataType::kVector6d},
    {"actual_qd", DataType::kVector6d},
    {"target_q", DataType::kVector6d},
    {"actual_TCP_pose", DataType::kVector6d},
    {"robot_mode", DataType::kInt32},
    {"safety_mode", DataType::kInt32},
    {"safety_status", DataType::kInt32},
    {"runtime_state", DataType::kUint32},
    {"robot_status_bits", DataType::kUint32},
    {"safety_status_bits", DataType::kUint32},
    {"speed_scaling", DataType::kDouble},
    {"target_speed_fraction", DataType::kDouble},
    {"output_int_register_24", DataType::kInt32},
    {"output_int_register_25", DataType::kInt32},
    {"output_int_register_26", DataType::kInt32},
    {"output_int_register_27", DataType::kInt32},
}};

/// What newer firmware has in addition: subscribed to after kOutputRecipe, without those that the controller does not
/// know.
inline constexpr std::array<Variable, 4> kOptionalOutputs{{
    {"time_scale_source", DataType::kInt32},
    {"payload", DataType::kDouble},
    {"payload_cog", DataType::kVector3d},
    {"tcp_offset", DataType::kVector6d},
}};

/// The output recipe of one session: kOutputRecipe and the optional variables that the controller has.
class OutputRecipe {
 public:
  OutputRecipe() noexcept;
  /// Leaves out the optional variables that `reply` marks as NOT_FOUND; false when there are none of these.
  [[nodiscard]] bool drop_unknown(std::string_view reply_types) noexcept;
  [[nodiscard]] std::span<const Variable> variables() const noexcept { return std::span(variables_).first(count_); }
  [[nodiscard]] std::size_t size() const noexcept { return fields_size(variables()); }
  /// Where the optional variable `name` starts in the fields, 0 when the session does without.
  [[nodiscard]] std::size_t offset(std::string_view name) const noexcept;

 private:
  std::array<Variable, kOutputRecipe.size() + kOptionalOutputs.size()> variables_{};
  std::size_t count_{0};
};

/// What we write: 108 bytes per package. Registers 24 to 47 are reserved for external RTDE clients.
inline constexpr std::array<Variable, 14> kInputRecipe{{
    {"input_int_register_24", DataType::kInt32},
    {"input_int_register_25", DataType::kInt32},
    {"input_double_register_24", DataType::kDouble},
    {"input_double_register_25", DataType::kDouble},
    {"input_double_register_26", DataType::kDouble},
    {"input_double_register_27", DataType::kDouble},
    {"input_double_register_28", DataType::kDouble},
    {"input_double_register_29", DataType::kDouble},
    {"input_double_register_30", DataType::kDouble},
    {"input_double_register_31", DataType::kDouble},
    {"input_double_register_32", DataType::kDouble},
    {"input_double_register_33", DataType::kDouble},
    {"input_double_register_34", DataType::kDouble},
    {"input_double_register_35", DataType::kDouble},
}};

inline constexpr std::int32_t kProgramVersion = 1;           ///< output_int_register_27
inline constexpr std::uint32_t kSequenceMask = 0x7FFF'FFFF;  ///< sequences wrap in 31 bits

using CommandPackage = std::array<std::byte, kFieldsStart + fields_size(kInputRecipe)>;

/// The controller's own words about whether the arm may move (RTDE guide, tables of modes and status bits).
struct ControllerStatus {
  std::int32_t robot_mode{0};
  std::int32_t safety_status{0};
  std::uint32_t safety_status_bits{0};
  std::uint32_t runtime_state{0};
  std::int32_t program_version{0};
  std::int32_t time_scale_source{0};  ///< why the speed is limited (status_text.hpp)
};

/// Settings of the installation that an arm must have right, as the controller reports them.
struct ArmSettings {
  double payload_kg{0.0};
  std::array<double, 3> cog_m{};  ///< centre of gravity of the payload in the flange frame
  std::array<double, 6> tcp{};    ///< tool centre point in the flange frame: position (m), rotation vector (rad)
};

/// Ready only if powered and running, safety normal or reduced, no stop bit set, and our control program playing.
/// The gravest applies: emergency stop, fault (also recovery mode and unknown codes), protective stop (also safeguard
/// and enabling-device stops), not running, program stopped.
[[nodiscard]] ArmCondition arm_condition(const ControllerStatus& status) noexcept;

/// Modes of a package. @pre fields.size() >= fields_size(kOutputRecipe)
[[nodiscard]] ControllerStatus decode_status(Bytes fields) noexcept;

/// Fills everything but `package` and `t_arrival` from the fields of an output package. False, with `state` unchanged,
/// when the time stamp or a joint value is not finite. `tracking` is true only while `condition` is kReady: a stopped
/// program leaves its last state in the register.
/// @pre fields.size() >= fields_size(kOutputRecipe)
[[nodiscard]] bool decode_state(Bytes fields, ArmState& state) noexcept;

/// Fills a whole input package. Targets are written for kTrack only, zeros otherwise.
void encode_command(const ArmCommand& command, std::uint8_t recipe, CommandPackage& package) noexcept;

}  // namespace embody::rtde
