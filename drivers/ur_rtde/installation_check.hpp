#pragma once
// Is the robot set up as the configuration says? Arm model, payload and tool centre point.
#include <optional>
#include <string>

#include "core/base/result.hpp"
#include "drivers/ur_rtde/arm_package.hpp"
#include "drivers/ur_rtde/primary_codec.hpp"

namespace embody::ur {

/// Nothing is compared that is not set.
struct ExpectedInstallation {
  std::string model;  ///< "UR10e", ...
  std::optional<double> payload_kg;
  std::optional<std::array<double, 3>> cog_m;  ///< centre of gravity of the payload in the flange frame
  std::optional<std::array<double, 6>> tcp;    ///< in the flange frame: position (m), rotation vector (rad)

  [[nodiscard]] bool has_settings() const noexcept { return payload_kg || cog_m || tcp; }
};

/// Fine within 0.1 kg, 5 mm and 0.02 rad; otherwise kRefused with both values. A wrong payload makes protective stops
/// and wrong force limits.
[[nodiscard]] Status check_settings(const ExpectedInstallation& expected, const rtde::ArmSettings& reported) noexcept;

/// Fine when the model is not set, or its geometry is the controller's. Errors: kNotFound (no such model), kRefused.
[[nodiscard]] Status check_geometry(const ExpectedInstallation& expected, const UrKinematics& reported,
                                    std::uint32_t controller_major) noexcept;

}  // namespace embody::ur
