#include "daemon/app/devices.hpp"

#include <algorithm>

#include "daemon/dds/joint_state_hand.hpp"
#include "drivers/landmarks/landmark_tracker.hpp"
#include "drivers/mia/can_line.hpp"
#include "drivers/mia/compact/mia_can_hand.hpp"
#include "drivers/mia/mia_hand.hpp"
#include "drivers/qualisys/qualisys_tracker.hpp"
#include "drivers/robotiq/robotiq_hand.hpp"
#include "drivers/ur_rtde/ur_rtde_arm.hpp"

namespace embody {
namespace {

Vector6 vector6(const std::array<double, 6>& values) {
  return Eigen::Map<const Vector6>(values.data());
}

std::unique_ptr<HandTracker> make_landmarks(const config::EmbodyConfig& config) {
  landmarks::LandmarkConfig landmarks;
  landmarks.address = config.tracker.landmarks.address;
  landmarks.port = static_cast<std::uint16_t>(config.tracker.landmarks.port);
  landmarks.rate_hz = config.tracker.landmarks.rate_hz;
  landmarks.side = config.subject.side;
  return std::make_unique<landmarks::LandmarkTracker>(landmarks);
}

/// A rigid body makes the markers on the back of the hand unnecessary.
std::vector<std::string> optional_markers(const config::EmbodyConfig& config) {
  if (config.tracker.rigid_body.empty()) return {};
  const auto& back = config.glove.back;
  return {back.top, back.left, back.right};
}

std::unique_ptr<HandTracker> make_qualisys(const config::EmbodyConfig& config) {
  const config::TrackerConfig& tracker = config.tracker;
  qualisys::QualisysConfig qualisys;
  qualisys.host = tracker.host;
  qualisys.port = static_cast<std::uint16_t>(tracker.port);
  qualisys.byte_order =
      tracker.byte_order == config::ByteOrder::kBig ? qualisys::ByteOrder::kBig : qualisys::ByteOrder::kLittle;
  qualisys.transport =
      tracker.transport == config::Transport::kUdp ? qualisys::Transport::kUdp : qualisys::Transport::kTcp;
  qualisys.udp_address = tracker.udp_address;
  qualisys.udp_port = static_cast<std::uint16_t>(tracker.udp_port);
  qualisys.rigid_body = tracker.rigid_body;
  qualisys.optional_markers = optional_markers(config);
  qualisys.allow_playback = tracker.allow_playback;
  return std::make_unique<qualisys::QualisysTracker>(qualisys, config.glove.names);
}

ur::ExpectedInstallation expected_installation(const config::ArmConfig& config) {
  const config::ArmInstallationConfig& installation = config.installation;
  ur::ExpectedInstallation expected;
  expected.model = robot::model_of(config.model).name;
  if (installation.check_payload) {
    expected.payload_kg = installation.payload_kg;
    expected.cog_m = installation.cog_m;
  }
  if (installation.check_tcp) {
    std::array<double, 6> tcp{};
    std::copy(installation.p_ETcp_m.begin(), installation.p_ETcp_m.end(), tcp.begin());
    std::copy(installation.r_ETcp_rad.begin(), installation.r_ETcp_rad.end(), tcp.begin() + 3);
    expected.tcp = tcp;
  }
  return expected;
}

transport::CanId can_id(int value, const config::MiaHandConfig& config) {
  return {static_cast<std::uint32_t>(value), config.can_extended_ids};
}

mia::CanTunnelConfig can_tunnel(const config::MiaHandConfig& config) {
  mia::CanTunnelConfig tunnel;
  tunnel.interface = config.can_interface;
  tunnel.framing = config.wire == config::MiaWire::kCanIsoTp ? mia::CanFraming::kIsoTp : mia::CanFraming::kSegments;
  tunnel.tx = can_id(config.can_tx_id, config);
  tunnel.rx = can_id(config.can_rx_id, config);
  return tunnel;
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
  return std::make_unique<mia::MiaHand>(mia, mia::can_line(can_tunnel(config.mia)));
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

Status check_motors(const EmbodimentConfig& hand, config::HandDriverKind driver) {
  const auto& motors = hand.motors;
  if (driver == config::HandDriverKind::kMia &&
      !std::equal(motors.begin(), motors.end(), mia::kJointNames.begin(), mia::kJointNames.end())) {
    return make_error(Errc::kInvalidArgument,
                      "[hand] driver \"mia\" moves the motors %s, %s and %s; the hand file of \"%.40s\" has others",
                      mia::kJointNames[0], mia::kJointNames[1], mia::kJointNames[2], hand.name.c_str());
  }
  if (driver == config::HandDriverKind::kRobotiq && motors.size() != 1) {
    return make_error(Errc::kInvalidArgument,
                      "[hand] driver \"robotiq\" moves one motor; the hand file of \"%.40s\" has %zu",
                      hand.name.c_str(), motors.size());
  }
  return {};
}

}  // namespace

std::unique_ptr<HandTracker> make_tracker(const config::EmbodyConfig& config) {
  return config.tracker.driver == config::TrackerDriver::kLandmarks ? make_landmarks(config) : make_qualisys(config);
}

rtde::ControlScriptConfig control_script_config(const config::ArmConfig& config) {
  constexpr double kWidest_rad = 6.2;  // inside of the joints' two turns
  rtde::ControlScriptConfig script;
  script.max_velocity_rad_s = vector6(config.limits.joint_speed_rad_s);
  script.max_acceleration_rad_s2 = vector6(config.limits.joint_acceleration_rad_s2);
  script.min_angle_rad = vector6(config.limits.joint_lower_rad).cwiseMax(-kWidest_rad);
  script.max_angle_rad = vector6(config.limits.joint_upper_rad).cwiseMin(kWidest_rad);
  script.lookahead_s = config.program.lookahead_s;
  script.gain = config.program.gain;
  script.watchdog_hz = config.program.watchdog_hz;
  return script;
}

std::unique_ptr<ArmDriver> make_arm(const config::ArmConfig& config) {
  UrRtdeConfig ur;
  ur.host = config.host;
  ur.port = static_cast<std::uint16_t>(config.port);
  ur.frequency_hz = config.frequency_hz;
  ur.stale_after = config.stale_after;
  ur.upload = config.program.upload;
  ur.primary_port = static_cast<std::uint16_t>(config.program.port);
  ur.script = control_script_config(config);
  ur.expected = expected_installation(config);
  return std::make_unique<UrRtdeArm>(ur);
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

Status check_devices(const config::EmbodyConfig& config) {
  const EmbodimentConfig& hand = config.hand.embodiment;
  if (config.arm.driver != "ur_rtde") {
    return make_error(Errc::kInvalidArgument, "[arm] driver = \"%.40s\" is unknown; this version has \"ur_rtde\"",
                      config.arm.driver.c_str());
  }
  if (const Status motors = check_motors(hand, config.hand.driver); !motors) return motors;
  if (config.hand.driver == config::HandDriverKind::kJointState && !config.dds.enabled) {
    return make_error(Errc::kInvalidArgument, "[hand] driver \"joint_state\" needs [dds] enabled = true");
  }
  if (hand.side != config.subject.side) {
    const auto name = [](Side side) { return kSideNames[static_cast<std::size_t>(side)]; };
    return make_error(Errc::kInvalidArgument,
                      "[subject] side is %s, but [hand] side is %s: a hand follows its own kind",
                      name(config.subject.side), name(hand.side));
  }
  return {};
}

}  // namespace embody
