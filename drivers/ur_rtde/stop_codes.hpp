#pragma once
// What the controller's error codes mean for the person at the robot.

namespace embody::ur {

/// Meaning and remedy of "C<code>A<argument>", e.g. "sudden change of the target position"; empty for codes without an
/// entry. Source: Universal Robots, "Service manual: error codes".
[[nodiscard]] const char* stop_code_text(int code, int argument) noexcept;

}  // namespace embody::ur
