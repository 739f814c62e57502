#pragma once
// The serial protocol of Prensilia's Mia hand, both ends: pure functions over bytes, no allocation.
// Source: Prensilia's published ROS drivers (BSD-3): mia_hand_driver and mia_hand_ros2_pkgs; there is no public manual.
//   command  18 bytes: '@', 15 payload bytes padded with '.', '*', CR
//   ACK      17 bytes: '<', the payload, LF
//   data     a tag and fields at fixed offsets, LF; what stands between the fields is unknown and never looked at
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "drivers/mia/transmission.hpp"

namespace embody::mia {

inline constexpr std::size_t kCommandSize = 18;
inline constexpr std::size_t kPayloadSize = 15;
inline constexpr std::size_t kAckSize = 17;
inline constexpr std::size_t kMaxLine = 76;  ///< longest data line (strain gauges)
inline constexpr std::size_t kStrainFields = 8;

using Command = std::array<char, kCommandSize>;
using Ack = std::array<char, kAckSize>;

// --- Host: commands. Arguments outside of their range are clamped. ---

/// Moves `motor` to `counts` (thumb and MRL 0..255, index -255..255) at `speed_percent` 0..99.
[[nodiscard]] Command encode_motor_position(Motor motor, int counts, int speed_percent) noexcept;
/// Drives `motor` at `speed` -99..99 (positive closes; the vendor stays within 90, one unit is 65.45 rad/s at the
/// motor) with at most `current_percent` 0..80.
[[nodiscard]] Command encode_motor_speed(Motor motor, int speed, int current_percent) noexcept;
/// Closes a finger with `force_percent` 0..99 of a force whose unit nobody documents; older firmware only.
[[nodiscard]] Command encode_finger_force(Motor motor, int force_percent, int current_percent) noexcept;
/// Moves a joint to `angle_rad` (-3..3, negative for the index only) at `speed_percent`. Rounded to hundredths; the
/// vendor's own driver cuts them off.
[[nodiscard]] Command encode_joint_position(Motor motor, double angle_rad, int speed_percent) noexcept;
/// What encode_joint_position() sends of an angle, in hundredths of a rad.
[[nodiscard]] int joint_hundredths(Motor motor, double angle_rad) noexcept;
/// Drives a joint at `speed_rad_s` (-9.9..9.9, rounded to tenths) with at most `current_percent` 0..80.
[[nodiscard]] Command encode_joint_speed(Motor motor, double speed_rad_s, int current_percent) noexcept;
/// One reading of a channel: P motor positions, S speeds, C currents, A strain gauges, J joint angles, j joint speeds.
[[nodiscard]] Command encode_read(char channel) noexcept;
/// Switches the stream of a channel (P, S, A, C).
[[nodiscard]] Command encode_stream(char channel, bool on) noexcept;
/// A command without arguments; the text is cut at 15 bytes.
[[nodiscard]] Command encode_plain(std::string_view payload) noexcept;
inline constexpr std::string_view kStopAllPayload = "AS";
inline constexpr std::string_view kReadPositionsPayload = "ADPo";
inline constexpr std::string_view kFirmwareIdPayload = "SR";
inline constexpr std::string_view kCalibratePayload = "AF";  ///< moves the hand
inline constexpr std::string_view kPingPayload = "MiaHandCommand";
inline constexpr std::string_view kOldPingPayload = "?AreYouPlugged?";

// --- Host: lines. Each function looks at the end of the line, so that rubbish before it does no harm. ---

/// True when `line` ends with an ACK, of whatever command.
[[nodiscard]] bool is_acknowledgement(std::string_view line) noexcept;
/// True when `line` (with its LF) ends with the ACK of `command`. Bytes 1..14 are compared, as the vendor does.
[[nodiscard]] bool acknowledges(std::string_view line, const Command& command) noexcept;

/// The three-field lines: 'e' positions (counts), 's' speeds, 'c' currents, 31 bytes.
enum class TripleLine : char { kPosition = 'e', kSpeed = 's', kCurrent = 'c' };
/// Fields in the order of Motor, or nothing when the line is not that.
[[nodiscard]] std::optional<std::array<int, kMotors>> parse_triple(std::string_view line, TripleLine kind) noexcept;
/// "JP" line, 15 bytes: joint angles in rad.
[[nodiscard]] std::optional<std::array<double, kMotors>> parse_joint_positions(std::string_view line) noexcept;
/// "JS" line, 12 bytes: joint speeds in rad/s.
[[nodiscard]] std::optional<std::array<double, kMotors>> parse_joint_speeds(std::string_view line) noexcept;
/// 'a' line, 76 bytes: raw strain gauges, in the order of the wire.
[[nodiscard]] std::optional<std::array<int, kStrainFields>> parse_strain_gauges(std::string_view line) noexcept;
/// Firmware line ('F', 10 or 28 bytes): its text without the LF.
[[nodiscard]] std::optional<std::string_view> parse_firmware_id(std::string_view line) noexcept;

/// Gathers the bytes of a serial line into LF-terminated lines. Never more than `kCapacity` bytes: when that many came
/// without an LF, the oldest are forgotten, so that the next good line is still found at the end.
class LineAssembler {
 public:
  static constexpr std::size_t kCapacity = 256;
  /// Takes one byte; true when it completed a line. The line is valid until the next push().
  bool push(char byte) noexcept;
  [[nodiscard]] std::string_view line() const noexcept { return {buffer_.data(), size_}; }
  void clear() noexcept { size_ = 0; }
  [[nodiscard]] std::uint64_t overflows() const noexcept { return overflows_; }

 private:
  std::array<char, kCapacity> buffer_{};
  std::size_t size_{0};
  bool complete_{false};
  std::uint64_t overflows_{0};
};

// --- Device: the other end, for simulators and tests. ---

/// What a command asks for.
struct Request {
  enum class Kind : std::uint8_t {
    kUnknown,
    kMotorPosition,  ///< value: counts, speed_percent
    kMotorSpeed,     ///< value: signed speed in vendor units, current_percent
    kFingerForce,    ///< value: percent, current_percent
    kJointPosition,  ///< value: hundredths of a rad, speed_percent
    kJointSpeed,     ///< value: tenths of a rad/s, current_percent
    kStopAll,
    kRead,         ///< one-shot read of `channel`
    kStream,       ///< `on` for `channel`
    kStopStreams,  ///< all channels off
    kFirmwareId,
    kCalibrate,
    kStore,               ///< write the settings to the EEPROM
    kGrasp,               ///< value: closure in percent, speed_percent, grasp
    kSetGraspReferences,  ///< motor, grasp
    kGetGraspReferences,  ///< motor, grasp
  };
  Kind kind{Kind::kUnknown};
  Motor motor{Motor::kThumb};
  int value{0};
  int speed_percent{0};
  int current_percent{0};
  char channel{'\0'};  ///< P position, S speed, A analog, C current, J joint position, j joint speed
  bool on{false};
  char grasp{'\0'};  ///< C cylindrical, P pinch, L lateral, ...
};

/// Understands a framed command. Anything else, broken digits included, is kUnknown (a ping too: its ACK is the reply).
[[nodiscard]] Request parse_command(const Command& command) noexcept;
[[nodiscard]] Ack encode_ack(const Command& command) noexcept;

/// A data line ready to be sent.
struct DataLine {
  std::array<char, kMaxLine> bytes{};
  std::size_t size{0};
  [[nodiscard]] std::string_view view() const noexcept { return {bytes.data(), size}; }
};
/// Fields in the order of Motor, clamped to five digits. Fillers are '.'.
[[nodiscard]] DataLine encode_triple(TripleLine kind, const std::array<int, kMotors>& values) noexcept;
[[nodiscard]] DataLine encode_joint_positions(const std::array<double, kMotors>& q_rad) noexcept;
[[nodiscard]] DataLine encode_joint_speeds(const std::array<double, kMotors>& qd_rad_s) noexcept;
[[nodiscard]] DataLine encode_strain_gauges(const std::array<int, kStrainFields>& values) noexcept;
/// The short form: at most eight characters.
[[nodiscard]] DataLine encode_firmware_id(std::string_view text) noexcept;

/// Finds commands in a stream of bytes: starts at '@', checks '*' and CR, and after a broken frame goes on at the next
/// '@' inside it.
class CommandAssembler {
 public:
  /// Takes one byte; a command when it completed one.
  std::optional<Command> push(char byte) noexcept;
  void clear() noexcept { size_ = 0; }
  [[nodiscard]] std::uint64_t skipped_bytes() const noexcept { return skipped_; }

 private:
  [[nodiscard]] bool fits() const noexcept;
  void drop_to_next_start() noexcept;

  Command buffer_{};
  std::size_t size_{0};
  std::uint64_t skipped_{0};
};

}  // namespace embody::mia
