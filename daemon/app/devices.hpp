#pragma once
// The drivers that the configuration asks for. Nothing is opened yet: that is connect().
#include <memory>

#include "core/hal/arm_driver.hpp"
#include "core/hal/hand_driver.hpp"
#include "core/hal/hand_tracker.hpp"
#include "daemon/app/config.hpp"
#include "drivers/mia/can_tunnel.hpp"
#include "drivers/ur_rtde/control_script.hpp"

namespace embody {

[[nodiscard]] std::unique_ptr<HandTracker> make_tracker(const config::EmbodyConfig& config);
[[nodiscard]] std::unique_ptr<ArmDriver> make_arm(const config::ArmConfig& config);
/// A hand by DDS uses the domain that a DdsPublisher of this process has opened.
[[nodiscard]] std::unique_ptr<HandDriver> make_hand(const config::EmbodyConfig& config);

/// How the serial protocol of a Mia travels on CAN.
[[nodiscard]] mia::CanTunnelConfig can_tunnel_config(const config::MiaHandConfig& config);

/// Do drivers, hand file and subject belong together? Errors: kInvalidArgument names the key.
[[nodiscard]] Status check_devices(const config::EmbodyConfig& config);

/// Limits that the control program on the robot keeps: those of the daemon.
[[nodiscard]] rtde::ControlScriptConfig control_script_config(const config::ArmConfig& config);

}  // namespace embody
