#pragma once
// The registers of Robotiq's two-finger grippers (2F-85, 2F-140) as values: pure functions, no allocation.
// Source: Robotiq, "2F-85 & 2F-140 Instruction Manual", chapter 4 (Control). Automatic release (rATR, rARD) is never
// asked for: it moves the fingers and ends in a fault.
#include <array>
#include <cstdint>
#include <span>

namespace embody::robotiq {

inline constexpr std::uint16_t kCommandAddress = 0x03E8;  ///< three registers that the host writes
inline constexpr std::uint16_t kStatusAddress = 0x07D0;   ///< three registers that the gripper writes
inline constexpr std::uint16_t kRegisterCount = 3;
inline constexpr int kMaxCounts = 255;

using Registers = std::array<std::uint16_t, kRegisterCount>;

/// What the host writes. All zero is a reset: the motor stands, the gripper forgets that it was activated, and no byte
/// sequence that follows moves it but a new activation.
struct GripperCommand {
  bool activate{false};      ///< rACT; going from 0 to 1 starts the activation, which opens and closes the fingers
  bool go{false};            ///< rGTO; false stops where the fingers are
  std::uint8_t position{0};  ///< rPR, 0 open .. 255 closed
  std::uint8_t speed{0};     ///< rSP, 0 slowest .. 255
  std::uint8_t force{0};     ///< rFR, 0 least .. 255
  friend bool operator==(const GripperCommand&, const GripperCommand&) = default;
};

enum class Activation : std::uint8_t { kReset = 0, kRunning = 1, kUnused = 2, kDone = 3 };
enum class ObjectState : std::uint8_t { kMoving = 0, kStoppedOpening = 1, kStoppedClosing = 2, kAtRequest = 3 };

/// What the gripper tells.
struct GripperStatus {
  bool activate{false};                       ///< gACT, echo of rACT
  bool go{false};                             ///< gGTO, echo of rGTO
  Activation activation{Activation::kReset};  ///< gSTA
  ObjectState object{ObjectState::kMoving};   ///< gOBJ; means nothing unless `go`
  std::uint8_t fault{0};                      ///< gFLT, 0..15
  std::uint8_t controller_fault{0};           ///< kFLT, 0..15, of the optional controller
  std::uint8_t position_echo{0};              ///< gPR
  std::uint8_t position{0};                   ///< gPO
  std::uint8_t current{0};                    ///< gCU, about 10 mA each
  friend bool operator==(const GripperStatus&, const GripperStatus&) = default;

  [[nodiscard]] bool activated() const noexcept { return activate && activation == Activation::kDone; }
  [[nodiscard]] double current_a() const noexcept { return 0.01 * current; }
};

[[nodiscard]] Registers pack(const GripperCommand& command) noexcept;
[[nodiscard]] GripperCommand unpack_command(const Registers& registers) noexcept;
[[nodiscard]] Registers pack(const GripperStatus& status) noexcept;
[[nodiscard]] GripperStatus unpack_status(const Registers& registers) noexcept;

/// A sentence for a gFLT code 0..15; never null.
[[nodiscard]] const char* fault_text(std::uint8_t fault) noexcept;
/// No fault, or one that ends by itself when the host speaks (9: no communication for a second).
[[nodiscard]] bool allows_motion(std::uint8_t fault) noexcept;
/// Only a reset and a new activation help (10 to 15).
[[nodiscard]] bool needs_activation(std::uint8_t fault) noexcept;

/// Between counts and the angle of the gripper's joint: a straight line through the two ends. The real linkage is not
/// quite straight, and the fingers stop some counts before the ends; neither was measured on hardware.
struct PositionScale {
  int open_counts{0};
  int closed_counts{kMaxCounts};
  double open_rad{0.0};
  double closed_rad{0.7};
};
/// Nearest count, clamped to the ends. @pre scale is usable (connect() checks), q_rad is finite
[[nodiscard]] int counts_of(const PositionScale& scale, double q_rad) noexcept;
[[nodiscard]] double angle_of(const PositionScale& scale, int counts) noexcept;

}  // namespace embody::robotiq
