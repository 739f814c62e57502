#pragma once
// The configuration of the robot hand on the other side.
#include "core/embodiment/embodiment_config.hpp"

namespace embody {

/// Mirror image of every number of a robot hand file at the plane x = 0 of its frames (core/robot/mirror.hpp): points,
/// pads and their directions, and X_PM, whose hand model M is then the mirror image as well (core/hand/mirror.cpp).
/// Motors, limits, couplings and weights stay, since the mirrored model takes the same joint angles; `side` stays, and
/// `file_side` changes, because the numbers now describe the other side. Twice gives the original. Allocates the copy.
[[nodiscard]] EmbodimentConfig mirrored(const EmbodimentConfig& config);

}  // namespace embody
