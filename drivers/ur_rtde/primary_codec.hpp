#pragma once
// Messages of the primary interface (TCP 30001) as pure functions over bytes: u32 total size (big-endian, header
// included), u8 type, contents. Robot states (type 16) hold parts of the same shape; robot messages (type 20) tell what
// happened: script errors, stop codes, the version. Sources: Universal Robots, "Remote control via TCP/IP" and its
// client interface tables. Layouts were compared with published captures of URSim, not with a robot of ours.
#include "drivers/ur_rtde/wire.hpp"

namespace embody::ur {

using rtde::Bytes;

inline constexpr std::size_t kPrimaryHeader = 5;
inline constexpr std::size_t kMaxPrimaryMessage = std::size_t{64} * 1024;  ///< real ones have about 1.5 kB
inline constexpr std::uint8_t kRobotState = 16;
inline constexpr std::uint8_t kRobotMessage = 20;
inline constexpr std::uint8_t kKinematicsPart = 5;

enum class PrimaryFraming {
  kComplete,
  kIncomplete,  ///< more bytes are needed
  kBroken,      ///< an impossible size: the stream cannot be followed any further
};

struct PrimaryMessage {
  PrimaryFraming framing{PrimaryFraming::kIncomplete};
  std::uint8_t type{0};
  Bytes contents;       ///< without the header; views the caller's bytes
  std::size_t size{0};  ///< bytes that the message takes, header included
};

/// Looks at the message, or at the part of a robot state, at the start of `bytes`.
[[nodiscard]] PrimaryMessage parse_primary(Bytes bytes) noexcept;

/// Geometry of one arm in Denavit-Hartenberg parameters (standard convention), joint by joint: the nominal table with
/// the factory calibration worked in. Calibrated `d_m` of joints 2 and 3 may be hundreds of metres, taken back by each
/// other: compare poses of the flange, never single values (ur_models.hpp).
struct UrKinematics {
  std::array<double, 6> theta_rad{};
  std::array<double, 6> a_m{};
  std::array<double, 6> d_m{};
  std::array<double, 6> alpha_rad{};
  std::array<std::uint32_t, 6> checksum{};
  std::uint32_t calibration_status{0};  ///< 0 calibrated, as far as published
};

/// KinematicsInfo of a robot state; nullopt when the state has none, or values are not finite.
[[nodiscard]] std::optional<UrKinematics> decode_kinematics(Bytes robot_state) noexcept;

enum class MessageKind : std::uint8_t {
  kText = 0,
  kVersion = 3,
  kSafetyMode = 5,
  kErrorCode = 6,
  kKey = 7,
  kRuntimeException = 10,
};

/// Level of an error code message.
inline constexpr std::int32_t kViolationLevel = 3;

/// What a robot message says; texts view the caller's bytes. Fields that the kind does not have are zero.
struct RobotMessage {
  std::uint8_t kind{0};  ///< MessageKind, or one that is not listed
  std::uint64_t timestamp_us{0};
  std::int32_t code{0};  ///< Cxxx, or the number of a key message
  std::int32_t argument{0};
  std::int32_t level{0};   ///< of an error code: 1 information, 2 warning, 3 violation, 4 fault
  std::int32_t line{0};    ///< of a runtime exception: line of the script, from 1
  std::int32_t column{0};  ///< of a runtime exception
  std::uint8_t major{0};   ///< of a version
  std::uint8_t minor{0};
  std::string_view title;  ///< of a key message ("PROGRAM_XXX_STARTED"), or the project of a version
  std::string_view text;
  [[nodiscard]] bool is(MessageKind wanted) const noexcept { return kind == static_cast<std::uint8_t>(wanted); }
};

/// Contents of a message of type kRobotMessage; nullopt when they are too short for their kind.
[[nodiscard]] std::optional<RobotMessage> decode_robot_message(Bytes contents) noexcept;

}  // namespace embody::ur
