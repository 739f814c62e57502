#pragma once
// Which chain of a robot hand is which finger, on which side, and where palm and fingers look: from geometry alone.
// Rules, in this order; each result says which rule it rests on, so that a person can check the weak ones:
//   thumb   the finger whose closing axis is turned farthest from the others' (mean angle, 20 degrees ahead of the
//   next);
//           else the one whose knuckle is farthest from the others (1.5 spacings); else one whose links or joints are
//           called "thumb" or "th..."; else the first (of two: the one with a motor of its own).
//   order   the other fingers by position along their line of knuckles, starting at the end nearer to the thumb.
//   side    right when thumb side = finger direction x palmar direction, as in a right hand.
#include <array>
#include <optional>
#include <vector>

#include "core/hal/types.hpp"
#include "core/robot/serial_fingers.hpp"

namespace embody::robot {

enum class ThumbRule { kAxis, kBase, kName, kFirst };

/// An independent joint and those that follow it.
struct MimicGroup {
  std::size_t joint{0};
  std::vector<std::size_t> followers;
};

struct HandAnatomy {
  std::size_t palm_link{0};
  std::vector<std::size_t> wrist_joints;                      ///< moving joints before the palm: they stand still
  std::array<std::optional<SerialFinger>, kFingers> fingers;  ///< by Finger; a hand may lack some
  std::vector<SerialFinger> bars;                             ///< second bars of linkages; no fingers
  std::vector<SerialFinger> left_out;                         ///< fingers beyond the fifth
  std::vector<MimicGroup> mimic_groups;
  ThumbRule thumb_rule{ThumbRule::kFirst};
  Side side{Side::kRight};
  bool side_sure{false};  ///< false: the thumb stands in the middle, or there is one finger beside it
  /// Palm frame Q in the root link P, open posture: origin between the knuckles of the fingers other than the thumb, x
  /// their direction, y the palmar direction (into which closing moves their tips), z = x cross y: the thumb side of a
  /// right hand.
  math::Pose X_PQ{math::Pose::Identity()};

  [[nodiscard]] const std::optional<SerialFinger>& finger(Finger which) const noexcept {
    return fingers[static_cast<std::size_t>(which)];
  }
};

/// Pure function of the model. Names count only where the rules above say so; the order of links and joints and the
/// placement of the root link do not count. Errors: as find_serial_fingers(); kUnsupported (the fingers neither point
/// nor close anywhere).
[[nodiscard]] Result<HandAnatomy> find_hand_anatomy(const RobotModel& model);

}  // namespace embody::robot
