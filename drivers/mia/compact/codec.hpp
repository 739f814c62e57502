#pragma once
// Profile "compact" of a Mia hand on CAN: one frame per motor and purpose. Pure functions over frames, both ends.
// This is a user-defined CAN profile, not a Prensilia specification, and unverified on hardware: it needs a gateway
// (a small microcontroller between CAN and the hand's serial line) that speaks it.
//
// Identifiers are a base plus an offset; numbers are little endian; motors are numbered as in mia::Motor.
//   +0x00..+0x02  command to one motor, +0x03 to all: opcode, motor (3: all), int16 value, speed %, current %, counter,
//                 CRC. The counter goes up by one with each frame of its identifier.
//   +0x0F         heartbeat of the host: 1 when it may move the hand else 0, five zeros, counter, CRC
//   +0x10..+0x12  state of a motor, cyclic: int16 position (counts), int16 speed (vendor units), uint16 current, flags,
//                 counter
//   +0x13         forces, cyclic: six strain gauges of ten bits from bit 0 on, then a counter of four bits
//   +0x1F         acknowledgement: opcode, motor, status, counter of the command, three zeros, CRC
// CRC: eight bits, polynomial 0x2F, initial value and final XOR 0xFF (AUTOSAR's CRC8H2F), over the bytes before it.
#include <array>
#include <cstdint>
#include <span>

#include "drivers/mia/transmission.hpp"
#include "drivers/transport/can_frame.hpp"

namespace embody::mia::compact {

using transport::CanFrame;
using transport::CanId;

/// The identifiers of one hand.
struct Ids {
  CanId base{0x200};

  [[nodiscard]] constexpr CanId at(std::uint32_t offset) const noexcept { return {base.value + offset, base.extended}; }
};
inline constexpr std::uint32_t kCommandId = 0x00;
inline constexpr std::uint32_t kHeartbeatId = 0x0F;
inline constexpr std::uint32_t kStateId = 0x10;
inline constexpr std::uint32_t kForcesId = 0x13;
inline constexpr std::uint32_t kAckId = 0x1F;
inline constexpr std::uint32_t kLastId = 0x1F;

enum class Opcode : std::uint8_t {
  kStop,           ///< stands still at once
  kPosition,       ///< value: counts
  kSpeed,          ///< value: vendor units, positive closes
  kJointPosition,  ///< value: mrad
  kJointSpeed,     ///< value: mrad/s
  kGrasp,          ///< all motors; value: letter of the grasp, closure % << 8
  kCalibrate,      ///< all motors
  kPing,           ///< all motors; opens a session: heartbeats are awaited from now on, a stop for want of them is over
  kStream,         ///< all motors; value: states per second (0: none); speed %: a forces frame after so many states
};
inline constexpr std::uint8_t kOpcodes = 9;
inline constexpr std::uint8_t kAllMotors = 3;

struct Command {
  Opcode opcode{Opcode::kStop};
  std::uint8_t motor{kAllMotors};
  std::int16_t value{0};
  std::uint8_t speed_percent{0};
  std::uint8_t current_percent{0};
  std::uint8_t counter{0};

  friend bool operator==(const Command&, const Command&) = default;
};

enum class AckStatus : std::uint8_t {
  kDone,
  kUnknown,       ///< no such opcode for this motor
  kOutOfRange,    ///< the value is not possible
  kStopped,       ///< it missed our heartbeat and moves only after a ping
  kUncalibrated,  ///< it does not know its positions
};
inline constexpr std::uint8_t kAckStatuses = 5;

struct Ack {
  Opcode opcode{Opcode::kStop};
  std::uint8_t motor{kAllMotors};
  AckStatus status{AckStatus::kDone};
  std::uint8_t counter{0};

  friend bool operator==(const Ack&, const Ack&) = default;
};

/// Bits of State::flags.
inline constexpr std::uint8_t kMoving = 1;
inline constexpr std::uint8_t kBlocked = 2;
inline constexpr std::uint8_t kCalibrated = 4;
inline constexpr std::uint8_t kHeartbeatLost = 8;
inline constexpr std::uint8_t kUnderVoltage = 16;

struct State {
  std::int16_t counts{0};  ///< within +-2 * kMaxCounts
  std::int16_t speed{0};
  std::uint16_t current{0};
  std::uint8_t flags{0};
  std::uint8_t counter{0};

  friend bool operator==(const State&, const State&) = default;
};

inline constexpr std::size_t kStrainGauges = 6;
struct Forces {
  std::array<std::uint16_t, kStrainGauges> raw{};  ///< 0..1023, order of the serial 'a' line
  std::uint8_t counter{0};                         ///< 0..15

  friend bool operator==(const Forces&, const Forces&) = default;
};

struct Heartbeat {
  bool may_move{false};
  std::uint8_t counter{0};

  friend bool operator==(const Heartbeat&, const Heartbeat&) = default;
};

/// CRC8H2F of `bytes`; "123456789" gives 0xDF.
[[nodiscard]] std::uint8_t crc8(std::span<const std::uint8_t> bytes) noexcept;

[[nodiscard]] CanFrame encode(const Ids& ids, const Command& command) noexcept;
[[nodiscard]] CanFrame encode(const Ids& ids, const Ack& ack) noexcept;
/// @pre motor < kMotors
[[nodiscard]] CanFrame encode(const Ids& ids, std::size_t motor, const State& state) noexcept;
/// Values above 1023 are sent as 1023.
[[nodiscard]] CanFrame encode(const Ids& ids, const Forces& forces) noexcept;
[[nodiscard]] CanFrame encode(const Ids& ids, const Heartbeat& heartbeat) noexcept;

enum class Verdict : std::uint8_t {
  kGood,
  kForeign,  ///< another identifier
  kDamaged,  ///< wrong length or CRC, or a value that does not exist
};

[[nodiscard]] Verdict decode(const Ids& ids, const CanFrame& frame, Command& command) noexcept;
[[nodiscard]] Verdict decode(const Ids& ids, const CanFrame& frame, Ack& ack) noexcept;
[[nodiscard]] Verdict decode(const Ids& ids, const CanFrame& frame, std::size_t& motor, State& state) noexcept;
[[nodiscard]] Verdict decode(const Ids& ids, const CanFrame& frame, Forces& forces) noexcept;
[[nodiscard]] Verdict decode(const Ids& ids, const CanFrame& frame, Heartbeat& heartbeat) noexcept;

}  // namespace embody::mia::compact
