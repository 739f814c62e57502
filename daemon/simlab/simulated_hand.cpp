#include "daemon/simlab/simulated_hand.hpp"

#include "daemon/simlab/hands.hpp"

namespace embody::sim {

std::unique_ptr<SimulatedHand> make_simulated_hand(const config::EmbodyConfig& config, const HandOptions& options) {
  switch (config.hand.driver) {
    case config::HandDriverKind::kRobotiq:
      return make_robotiq(config.hand, options);
    case config::HandDriverKind::kJointState:
      return make_dds_hand(config, options);
    case config::HandDriverKind::kMia:
      break;
  }
  const bool serial = config.hand.mia.wire == config::MiaWire::kSerial;
  return serial ? make_serial_mia(config.hand, options) : make_can_mia(config.hand, options);
}

}  // namespace embody::sim
