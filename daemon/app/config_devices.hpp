#pragma once
// Configuration of the devices: tracker, arm, hand.
#include <array>
#include <chrono>
#include <cstdint>
#include <string>

#include "core/hal/types.hpp"
#include "core/robot/ur_kinematics.hpp"
#include "daemon/app/config_embodiment.hpp"
#include "daemon/app/config_field.hpp"

namespace embody::config {

/// Where a tracker of hand landmarks sends its datagrams (docs/landmarks.md).
struct LandmarkConfig {
  std::string address{"127.0.0.1"};
  int port{21021};
  double rate_hz{30.0};

  template <class V>
  void visit(V& v) {
    v.field("address", address,
            "IPv4 address of the interface to receive at. Whoever can send to it moves the hand: not the loopback only "
            "in a network of its own.");
    v.field("port", port, Range{1, 65535}, "UDP port.");
    v.field("rate_hz", rate_hz, Range{10, 1000}, "Frames per second that the sender nominally makes.");
  }
};

enum class TrackerDriver : std::uint8_t { kQualisys, kLandmarks };
inline constexpr std::array<const char*, 2> kTrackerDriverNames{"qualisys", "landmarks"};

enum class ByteOrder : std::uint8_t { kLittle, kBig };
inline constexpr std::array<const char*, 2> kByteOrderNames{"little", "big"};
enum class Transport : std::uint8_t { kTcp, kUdp };
inline constexpr std::array<const char*, 2> kTransportNames{"tcp", "udp"};

struct TrackerConfig {
  TrackerDriver driver{TrackerDriver::kQualisys};
  std::string host{"127.0.0.1"};
  int port{22223};
  ByteOrder byte_order{ByteOrder::kLittle};
  Transport transport{Transport::kTcp};
  std::string udp_address;
  int udp_port{0};
  std::string rigid_body;
  std::array<double, 3> p_BodyH_m{0.0, 0.0, 0.0};
  std::array<double, 3> r_BodyH_rad{0.0, 0.0, 0.0};
  bool allow_playback{false};
  LandmarkConfig landmarks;

  template <class V>
  void visit(V& v) {
    v.choice("driver", driver, kTrackerDriverNames,
             "qualisys: a marker glove, from Qualisys Track Manager (QTM); landmarks: 21 hand landmarks that a "
             "camera-based tracker sends as datagrams. `[glove]` and `X_HM_exponential` belong to the glove.");
    v.field("host", host, "qualisys: name or address of the tracking computer.");
    v.field("port", port, Range{1, 65535}, "qualisys: TCP port; 22223 is the little-endian real-time port of QTM.");
    v.choice("byte_order", byte_order, kByteOrderNames,
             "qualisys: of that port; QTM's port 22224 is the big-endian one.");
    v.choice("transport", transport, kTransportNames,
             "qualisys: how frames come. udp does not wait for what was lost; commands stay on TCP.");
    v.field("udp_address", udp_address,
            "qualisys: IPv4 address of ours that datagrams come to; empty: that of the connection to the tracking "
            "computer. Datagrams of other computers are dropped.");
    v.field("udp_port", udp_port, Range{0, 65535}, "qualisys: our UDP port; 0: a free one.");
    v.field("rigid_body", rigid_body,
            "qualisys: name of a rigid body (6DOF) on the back of the hand that gives its pose in place of the three "
            "markers; empty: none.");
    v.field("p_BodyH_m", p_BodyH_m, Range{-1, 1}, "Marker frame H in the rigid body: position.");
    v.field("r_BodyH_rad", r_BodyH_rad, Range{-2 * kPi, 2 * kPi}, "Marker frame H in the rigid body: rotation vector.");
    v.field("allow_playback", allow_playback,
            "qualisys: accept a recording that the tracking computer plays back. Off: a robot follows live "
            "measurements only.");
    v.section("landmarks", landmarks, "Used with `driver = \"landmarks\"`.");
  }
};

/// What no command to the arm exceeds, whatever the operator's hand does.
struct ArmLimitsConfig {
  double speed_m_s{0.25};
  double speed_rad_s{1.0};
  std::array<double, 6> joint_speed_rad_s{1.0, 1.0, 1.5, 2.0, 2.0, 2.0};
  std::array<double, 6> joint_acceleration_rad_s2{4.0, 4.0, 6.0, 10.0, 10.0, 10.0};
  std::array<double, 6> joint_lower_rad{-2 * kPi, -2 * kPi, -kPi, -2 * kPi, -2 * kPi, -2 * kPi};
  std::array<double, 6> joint_upper_rad{2 * kPi, 2 * kPi, kPi, 2 * kPi, 2 * kPi, 2 * kPi};
  std::array<double, 3> workspace_min_m{-1.2, -1.2, -0.2};
  std::array<double, 3> workspace_max_m{1.2, 1.2, 1.3};

  template <class V>
  void visit(V& v) {
    v.field("speed_m_s", speed_m_s, Range{0.001, 3}, "Greatest speed of the flange.");
    v.field("speed_rad_s", speed_rad_s, Range{0.001, 10}, "Greatest turning speed of the flange.");
    v.field("joint_speed_rad_s", joint_speed_rad_s, Range{0.001, 3.2}, "Greatest speed of each joint, base first.");
    v.field("joint_acceleration_rad_s2", joint_acceleration_rad_s2, Range{0.01, 40},
            "Greatest acceleration of each joint.");
    v.field("joint_lower_rad", joint_lower_rad, Range{-2 * kPi, 2 * kPi}, "Lower end of each joint's range.");
    v.field("joint_upper_rad", joint_upper_rad, Range{-2 * kPi, 2 * kPi}, "Upper end of each joint's range.");
    v.field("workspace_min_m", workspace_min_m, Range{-2, 2},
            "Lower corner of the box (frame B) that the flange may "
            "be in.");
    v.field("workspace_max_m", workspace_max_m, Range{-2, 2}, "Upper corner of that box.");
  }
  [[nodiscard]] std::string problem() const;
};

enum class Clutch : std::uint8_t { kAbsolute, kRelative };
inline constexpr std::array<const char*, 2> kClutchNames{"absolute", "relative"};

/// The control program that runs on the robot.
struct ArmProgramConfig {
  bool upload{true};
  int port{30001};
  double lookahead_s{0.05};
  double gain{600.0};
  double watchdog_hz{10.0};

  template <class V>
  void visit(V& v) {
    v.field("upload", upload,
            "Load the control program whenever the robot runs and no program plays. Off: it is started by hand.");
    v.field("port", port, Range{1, 65535}, "TCP port of the controller's primary interface, that takes the program.");
    v.field("lookahead_s", lookahead_s, Range{0.03, 0.2},
            "Of `servoj`: smooths and delays the motion by about this much.");
    v.field("gain", gain, Range{100, 2000}, "Of `servoj`: greater is stiffer, and may ring.");
    v.field("watchdog_hz", watchdog_hz, Range{1, 50},
            "Fewer packages per second end the program. It brakes long before, 50 ms after the last command.");
  }
};

/// What the robot's installation must say; a difference is told and nothing else is done.
struct ArmInstallationConfig {
  bool check_payload{false};
  double payload_kg{0.0};
  std::array<double, 3> cog_m{0.0, 0.0, 0.0};
  bool check_tcp{false};
  std::array<double, 3> p_ETcp_m{0.0, 0.0, 0.0};
  std::array<double, 3> r_ETcp_rad{0.0, 0.0, 0.0};

  template <class V>
  void visit(V& v) {
    v.field("check_payload", check_payload, "Compare payload and centre of gravity with the robot's own settings.");
    v.field("payload_kg", payload_kg, Range{0, 50}, "Mass of what the flange carries: robot hand, adapter, cables.");
    v.field("cog_m", cog_m, Range{-1, 1}, "Its centre of gravity in the flange frame E.");
    v.field("check_tcp", check_tcp, "Compare the tool centre point with the robot's own setting.");
    v.field("p_ETcp_m", p_ETcp_m, Range{-2, 2}, "Tool centre point in the flange frame E: position.");
    v.field("r_ETcp_rad", r_ETcp_rad, Range{-2 * kPi, 2 * kPi}, "Tool centre point: rotation vector.");
  }
};

struct ArmConfig {
  std::string driver{"ur_rtde"};
  robot::UrArm model{robot::UrArm::kUr10e};
  std::string host{"127.0.0.1"};
  int port{30004};
  double frequency_hz{500.0};
  Clutch clutch{Clutch::kAbsolute};
  double blend_speed_m_s{0.25};
  double blend_speed_rad_s{0.8};
  milliseconds resample_delay{25};
  milliseconds stale_after{100};
  int dashboard_port{29999};
  ArmProgramConfig program;
  ArmInstallationConfig installation;
  ArmLimitsConfig limits;

  template <class V>
  void visit(V& v) {
    v.field("driver", driver, "Which driver moves the arm.");
    v.choice("model", model, robot::kUrModelNames, "The arm; its kinematics are the vendor's nominal ones.");
    v.field("host", host, "Name or address of the arm's controller.");
    v.field("port", port, Range{1, 65535}, "TCP port of the controller's real-time data exchange (RTDE).");
    v.field("frequency_hz", frequency_hz, Range{50, 500},
            "Packages per second: 500 for e-Series, 125 for CB3. The controller sends a whole part of its own rate.");
    v.choice("clutch", clutch, kClutchNames,
             "absolute: the robot goes where the hand is; relative: it repeats the motion since engaging.");
    v.field("blend_speed_m_s", blend_speed_m_s, Range{0.001, 3},
            "Speed at which the robot catches up with the hand after engaging.");
    v.field("blend_speed_rad_s", blend_speed_rad_s, Range{0.001, 10}, "The same for the orientation.");
    v.field("resample_delay_ms", resample_delay, Range{0, 200},
            "The hand pose is interpolated this far in the past, so that 100 Hz frames become a smooth 500 Hz path.");
    v.field("stale_after_ms", stale_after, Range{20, 5000},
            "The controller's clock stands still for so long: the connection counts as lost.");
    v.field("dashboard_port", dashboard_port, Range{1, 65535},
            "TCP port of the controller's dashboard server, for `embodyctl arm`.");
    v.section("program", program, "The control program on the robot.");
    v.section("installation", installation, "What the robot's installation must say.");
    v.section("limits", limits, "What no command to the arm exceeds.");
  }
};

enum class HandDriverKind : std::uint8_t { kMia, kRobotiq, kJointState };
inline constexpr std::array<const char*, 3> kHandDriverNames{"mia", "robotiq", "joint_state"};

enum class MiaProtocol : std::uint8_t { kAutomatic, kAcknowledging, kStreaming };
inline constexpr std::array<const char*, 3> kMiaProtocolNames{"automatic", "acknowledging", "streaming"};
enum class MiaSpace : std::uint8_t { kMotor, kJoint };
inline constexpr std::array<const char*, 2> kMiaSpaceNames{"motor", "joint"};

enum class MiaWire : std::uint8_t { kSerial, kCanIsoTp, kCanSegments, kCanCompact };
inline constexpr std::array<const char*, 4> kMiaWireNames{"serial", "can_isotp", "can_segments", "can_compact"};

/// Mia on a serial line, or on CAN by a gateway (docs/mia.md).
struct MiaHandConfig {
  MiaWire wire{MiaWire::kSerial};
  std::string can_interface{"can0"};
  int can_tx_id{0x340};
  int can_rx_id{0x341};
  int can_base_id{0x200};
  bool can_extended_ids{false};
  MiaProtocol protocol{MiaProtocol::kAutomatic};
  MiaSpace space{MiaSpace::kMotor};
  bool motion_after_restart{false};

  template <class V>
  void visit(V& v) {
    v.choice("wire", wire, kMiaWireNames,
             "serial: `[hand] device`. The others are CAN profiles of our own, not of the hand's maker, for a gateway "
             "that speaks them: can_isotp and can_segments carry the serial protocol, can_compact frames per motor.");
    v.field("can_interface", can_interface, "CAN interface; its bit rate is set outside (`ip link`).");
    v.field("can_tx_id", can_tx_id, Range{0, 0x1fffffff}, "can_isotp, can_segments: identifier of what we send.");
    v.field("can_rx_id", can_rx_id, Range{0, 0x1fffffff},
            "can_isotp, can_segments: identifier of what the hand sends.");
    v.field("can_base_id", can_base_id, Range{0, 0x1fffffe0}, "can_compact: first of the hand's 32 identifiers.");
    v.field("can_extended_ids", can_extended_ids, "Identifiers have 29 bits instead of 11.");
    v.choice("protocol", protocol, kMiaProtocolNames,
             "automatic: ask the hand. acknowledging: newer firmware, each command is answered; streaming: older one.");
    v.choice("space", space, kMiaSpaceNames,
             "motor: positions travel as motor counts, our transmission makes angles of them; joint: as angles, by the "
             "hand's own calibration (acknowledging firmware).");
    v.field("motion_after_restart", motion_after_restart,
            "A hand that restarted (supply voltage) has lost its zero. Off: it does not move until the daemon is "
            "restarted after a calibration; on: your word that its counters are right all the same.");
  }
};

/// Robotiq 2F-140 or 2F-85 on a serial line, Modbus RTU.
struct RobotiqHandConfig {
  int slave{9};
  int speed{255};
  int force{64};

  template <class V>
  void visit(V& v) {
    v.field("slave", slave, Range{1, 247}, "Modbus address; 9 as delivered.");
    v.field("speed", speed, Range{0, 255}, "0 to 255: slowest to fastest.");
    v.field("force", force, Range{0, 255}, "0 to 255: weakest to strongest grip.");
  }
};

/// A hand behind somebody else's driver (Shadow, Barrett), by DDS `sensor_msgs/JointState`.
struct JointStateHandConfig {
  std::string command_topic{"rt/embody/right/hand_command"};
  std::string state_topic{"rt/joint_states"};
  milliseconds state_timeout{500};
  bool stop_publishes_position{true};

  template <class V>
  void visit(V& v) {
    v.field("command_topic", command_topic, "DDS topic of the targets (ROS 2: without the leading `rt/`).");
    v.field("state_topic", state_topic, "DDS topic of the measured joints.");
    v.field("state_timeout_ms", state_timeout, Range{20, 10000},
            "Without a state for so long the hand counts as lost.");
    v.field("stop_publishes_position", stop_publishes_position,
            "A stop publishes the last measured position once; off: it only ends the commands.");
  }
};

struct HandConfig {
  HandDriverKind driver{HandDriverKind::kMia};
  std::string device{"/dev/ttyUSB0"};
  double rate_hz{20.0};
  int speed_percent{60};
  double joint_speed_rad_s{2.0};
  MiaHandConfig mia;
  RobotiqHandConfig robotiq;
  JointStateHandConfig joint_state;
  EmbodimentConfig embodiment;  ///< its keys are in this same table

  template <class V>
  void visit(V& v) {
    v.file_key("hands/mia.toml", "Hand file with keys of this table (`hands/*.toml`).");
    v.choice("driver", driver, kHandDriverNames,
             "mia: Prensilia Mia; robotiq: Robotiq 2F-140 or 2F-85; joint_state: any hand behind a driver of its own "
             "(Shadow, Barrett), by DDS.");
    v.field("device", device, "mia, robotiq: serial device of the hand.");
    v.field("rate_hz", rate_hz, Range{1, 500}, "Commands per second.");
    v.field("speed_percent", speed_percent, Range{1, 99}, "mia: speed of the motors, part of the greatest one.");
    v.field("joint_speed_rad_s", joint_speed_rad_s, Range{0.01, 20},
            "Greatest speed of the joint targets that are sent.");
    v.section("mia", mia, "Used with `driver = \"mia\"`.");
    v.section("robotiq", robotiq, "Used with `driver = \"robotiq\"`.");
    v.section("joint_state", joint_state, "Used with `driver = \"joint_state\"`.");
    v.merge(embodiment);
  }
  [[nodiscard]] std::string problem() const;
};

}  // namespace embody::config
