#pragma once
// The shipped Mia hand: configuration as the file has it, and its description.
#include "core/embodiment/embodiment_config.hpp"
#include "core/robot/urdf_model.hpp"

namespace embody::test {

/// Reads config/hands/mia.toml without the daemon's checks; throws toml::parse_error when it is broken.
EmbodimentConfig mia_config();
robot::RobotModel mia_model();

}  // namespace embody::test
