#pragma once
// Where the arm's flange must be so that the robotic hand's base covers the human hand's.
#include "core/math/pose.hpp"

namespace embody {

/// X_WP: root link of the robotic hand in the motion-capture world, for the measured hand-model base `X_WM` and the
/// constant embodiment `X_PM` (paper, section "Embodiment Mapping": T_world,robot = T_world,MANO T_robot,MANO^-1).
[[nodiscard]] inline math::Pose hand_base_target(const math::Pose& X_WM, const math::Pose& X_PM) noexcept {
  return X_WM * X_PM.inverse();
}

/// X_BE: flange in the arm base, for the mocap world in the arm base `X_BW` and the hand's mounting `X_EP` (root link
/// of the hand in the flange). All arguments are rigid; so is the result.
[[nodiscard]] inline math::Pose arm_target(const math::Pose& X_BW, const math::Pose& X_WM, const math::Pose& X_PM,
                                           const math::Pose& X_EP) noexcept {
  return X_BW * hand_base_target(X_WM, X_PM) * X_EP.inverse();
}

}  // namespace embody
