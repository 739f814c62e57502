#pragma once
// What embodyctl onboard writes: the hand file, the score card for people, and its figures for programs.
#include <string>

#include "core/embodiment/onboarding.hpp"

namespace embody::evaluate {

/// The hand file (config/hands/*.toml): keys of daemon/app/config_embodiment.hpp, with the guesses as comments.
/// `source` is the file that it comes from, for people.
[[nodiscard]] std::string onboard_toml(const Onboarding& onboarding, const std::string& source);

/// Table of the fingers and the sentences to check by eye.
[[nodiscard]] std::string onboard_text(const robot::RobotModel& model, const Onboarding& onboarding);

/// One JSON object with the same figures in SI units.
[[nodiscard]] std::string onboard_json(const robot::RobotModel& model, const Onboarding& onboarding);

}  // namespace embody::evaluate
