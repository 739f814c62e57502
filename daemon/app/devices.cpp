// Trackers and the arm, and what the devices of a configuration must have in common.
#include "daemon/app/devices.hpp"

#include <algorithm>

#include "drivers/landmarks/landmark_tracker.hpp"
#include "drivers/mia/transmission.hpp"
#include "drivers/qualisys/qualisys_tracker.hpp"
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
