#pragma once
// What a robot hand measures, as JSON for people and programs: the same for the daemon's status and `embodyctl hand`.
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "core/hal/types.hpp"

namespace embody {

/// Members (docs/control.md): condition, why_not, supply, position_rad, current_a or current_raw, force_raw. What the
/// hand does not measure is absent; nothing at all before the first reply. `joints` names the motors.
[[nodiscard]] nlohmann::ordered_json hand_json(const HandDeviceState& state, std::span<const std::string> joints);

}  // namespace embody
