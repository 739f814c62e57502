#pragma once
// Names of the controller's modes, for people.
#include <cstdint>

namespace embody::rtde {

/// "protective stop", "robot emergency stop", ...; "unknown safety status" for codes that the guide does not list.
[[nodiscard]] const char* safety_text(int safety_status) noexcept;
/// "running", "power off", ...
[[nodiscard]] const char* robot_mode_text(int robot_mode) noexcept;
/// "playing", "paused", ...
[[nodiscard]] const char* runtime_text(int runtime_state) noexcept;
/// Fault codes of the control program (output_int_register_26), e.g. "the target is too far from the arm".
[[nodiscard]] const char* program_fault_text(int fault) noexcept;
/// Why the controller moves slower than asked ("tool speed limit"); "full speed" when it does not.
[[nodiscard]] const char* time_scale_text(int time_scale_source) noexcept;
/// What a person has to do before the arm may move again, empty for normal and reduced.
[[nodiscard]] const char* safety_advice(int safety_status) noexcept;

}  // namespace embody::rtde
