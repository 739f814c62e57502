// Robot hands.
#include "daemon/app/devices.hpp"
#include "daemon/dds/joint_state_hand.hpp"
#include "drivers/mia/can_line.hpp"
#include "drivers/mia/compact/mia_can_hand.hpp"
#include "drivers/mia/mia_hand.hpp"
#include "drivers/robotiq/robotiq_hand.hpp"

namespace embody {
namespace {

transport::CanId can_id(int value, const config::MiaHandConfig& config) {
  return {static_cast<std::uint32_t>(value), config.can_extended_ids};
}

std::unique_ptr<HandDriver> make_mia(const config::HandConfig& config) {
  mia::MiaConfig mia;
  mia.device = config.device;
  mia.speed_percent = config.speed_percent;
  if (config.mia.protocol == config::MiaProtocol::kAcknowledging) mia.generation = mia::Generation::kAcknowledging;
  if (config.mia.protocol == config::MiaProtocol::kStreaming) mia.generation = mia::Generation::kStreaming;
  mia.space = config.mia.space == config::MiaSpace::kJoint ? mia::Space::kJoint : mia::Space::kMotor;
  mia.motion_after_restart = config.mia.motion_after_restart;
  if (config.mia.wire == config::MiaWire::kSerial) return std::make_unique<mia::MiaHand>(mia);
  mia.device = config.mia.can_interface;
  return std::make_unique<mia::MiaHand>(mia, mia::can_line(can_tunnel_config(config.mia)));
}

std::unique_ptr<HandDriver> make_compact_mia(const config::HandConfig& config) {
  mia::compact::CompactConfig compact;
  compact.interface = config.mia.can_interface;
  compact.ids.base = can_id(config.mia.can_base_id, config.mia);
  compact.speed_percent = config.speed_percent;
  compact.command_rate_hz = config.rate_hz;
  return std::make_unique<mia::compact::MiaCanHand>(compact);
}

/// @pre check_devices(): one motor, which is open at its lower limit.
std::unique_ptr<HandDriver> make_robotiq(const config::HandConfig& config) {
  robotiq::RobotiqConfig robotiq;
  robotiq.device = config.device;
  robotiq.slave = config.robotiq.slave;
  robotiq.joint = config.embodiment.motors.front();
  robotiq.rate_hz = config.rate_hz;
  robotiq.speed = config.robotiq.speed;
  robotiq.force = config.robotiq.force;
  robotiq.scale.open_rad = config.embodiment.motor_lower_rad.front();
  robotiq.scale.closed_rad = config.embodiment.motor_upper_rad.front();
  return std::make_unique<robotiq::RobotiqHand>(robotiq);
}

std::unique_ptr<HandDriver> make_joint_state(const config::EmbodyConfig& config) {
  dds::JointStateHandConfig hand;
  hand.domain = config.dds.domain;
  hand.command_topic = config.hand.joint_state.command_topic;
  hand.state_topic = config.hand.joint_state.state_topic;
  hand.joints = config.hand.embodiment.motors;
  hand.rate_hz = config.hand.rate_hz;
  hand.state_timeout = config.hand.joint_state.state_timeout;
  hand.stop_publishes_position = config.hand.joint_state.stop_publishes_position;
  return std::make_unique<dds::JointStateHand>(hand);
}

}  // namespace

mia::CanTunnelConfig can_tunnel_config(const config::MiaHandConfig& config) {
  mia::CanTunnelConfig tunnel;
  tunnel.interface = config.can_interface;
  tunnel.framing = config.wire == config::MiaWire::kCanIsoTp ? mia::CanFraming::kIsoTp : mia::CanFraming::kSegments;
  tunnel.tx = can_id(config.can_tx_id, config);
  tunnel.rx = can_id(config.can_rx_id, config);
  return tunnel;
}

std::unique_ptr<HandDriver> make_hand(const config::EmbodyConfig& config) {
  switch (config.hand.driver) {
    case config::HandDriverKind::kRobotiq:
      return make_robotiq(config.hand);
    case config::HandDriverKind::kJointState:
      return make_joint_state(config);
    case config::HandDriverKind::kMia:
      break;
  }
  return config.hand.mia.wire == config::MiaWire::kCanCompact ? make_compact_mia(config.hand) : make_mia(config.hand);
}

}  // namespace embody
