#pragma once
// Grasps that the hand performs by itself, in both forms that Prensilia's published drivers know. Teleoperation does
// not use them; they are here so that the protocol is whole. Pure functions over bytes. Nothing of this was tried on
// hardware.
#include "drivers/mia/codec.hpp"

namespace embody::mia {

/// Ids: C cylindrical, P pinch, L lateral, U point up, D point down, R relax; S spherical and T tridigital are empty
/// when the hand leaves the factory.
enum class OldGraspAction : char { kOpen = 'a', kClose = 'A', kModulate = 'M' };
/// Older firmware: closure 0..100 % (100 for open and close), speed 0..99 %.
[[nodiscard]] Command encode_old_grasp(char id, OldGraspAction action, int closure_percent, int speed_percent) noexcept;
/// Newer firmware: closure and speed 0..100 %.
[[nodiscard]] Command encode_grasp(char id, int closure_percent, int speed_percent) noexcept;

/// Older firmware: rest and closed position 0..255 counts (no sign travels), delay 0..100 %.
[[nodiscard]] Command encode_old_grasp_references(Motor motor, char id, int rest, int closed, int delay) noexcept;
/// Newer firmware: open and closed position, counts (negative for the index only).
[[nodiscard]] Command encode_grasp_references(Motor motor, char id, int open, int closed) noexcept;
[[nodiscard]] Command encode_get_grasp_references(Motor motor, char id) noexcept;

struct GraspReferences {
  int open{0};    ///< counts
  int closed{0};  ///< counts
  int delay{0};   ///< percent, presumably
  friend bool operator==(const GraspReferences&, const GraspReferences&) = default;
};
/// 'G' line, 29 bytes.
[[nodiscard]] std::optional<GraspReferences> parse_grasp_references(std::string_view line) noexcept;
[[nodiscard]] DataLine encode_grasp_reference_line(const GraspReferences& references) noexcept;

/// What a "set references" command of either form carries, or nothing when it is neither.
[[nodiscard]] std::optional<GraspReferences> parse_set_references(const Command& command) noexcept;

}  // namespace embody::mia
