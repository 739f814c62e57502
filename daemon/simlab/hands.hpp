#pragma once
// The hands that make_simulated_hand() chooses from, and what they share.
#include "daemon/simlab/simulated_hand.hpp"
#include "drivers/sim/mia/mia_simulator.hpp"

namespace embody::sim {

[[nodiscard]] std::unique_ptr<SimulatedHand> make_serial_mia(const config::HandConfig& hand,
                                                             const HandOptions& options);
/// Any wire but serial.
[[nodiscard]] std::unique_ptr<SimulatedHand> make_can_mia(const config::HandConfig& hand, const HandOptions& options);
/// Activated, as after a first host: `embodyd` never activates a gripper. @pre one motor
[[nodiscard]] std::unique_ptr<SimulatedHand> make_robotiq(const config::HandConfig& hand, const HandOptions& options);
/// By DDS; opens the domain of the configuration in this process.
[[nodiscard]] std::unique_ptr<SimulatedHand> make_dds_hand(const config::EmbodyConfig& config,
                                                           const HandOptions& options);

/// Firmware, link and log of a simulated Mia.
[[nodiscard]] MiaSimulatorConfig mia_simulator_config(const config::HandConfig& hand, const HandOptions& options);
/// Errors: kInvalidArgument, as MiaDevice::fault().
[[nodiscard]] Status check_mia_fault(MiaSimulatorConfig config, std::string_view words);

}  // namespace embody::sim
