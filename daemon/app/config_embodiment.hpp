#pragma once
// Keys of a robot hand file (config/hands/*.toml): visits core's EmbodimentConfig, which knows no file format.
#include <array>

#include "core/embodiment/embodiment_config.hpp"
#include "daemon/app/config_field.hpp"

namespace embody {

inline constexpr std::array<const char*, 2> kThumbModeNames{"opposed", "lateral"};

/// Visited by argument-dependent look-up; see config_field.hpp.
template <class V>
void visit_fields(V& v, FingerPoints& points) {
  v.field("link", points.link, "URDF link that carries both points; empty: the hand has no such finger.");
  v.field("tip_m", points.tip_m, config::Range{-0.5, 0.5}, "Point that follows the human tip marker, in that link.");
  v.field("middle_m", points.middle_m, config::Range{-0.5, 0.5},
          "Point that follows the human middle marker, in that link.");
}

template <class V>
void visit_fields(V& v, EmbodimentConfig& hand) {
  v.field("name", hand.name, "Name of the robot hand, for people.");
  v.path("urdf", hand.urdf, "Robot description of the hand (URDF).");
  v.field("root_link", hand.root_link, "Root link of the URDF: frame P.");
  v.field("X_PM", hand.X_PM, config::Range{-10, 10},
          "Pose of the hand model M in the root link P as exponential coordinates: three of rotation (rad), three of "
          "translation (m).");
  v.field("motors", hand.motors, "URDF joints that have a motor of their own, in the order of the driver.");
  v.field("motor_lower_rad", hand.motor_lower_rad, config::Range{-7, 7},
          "Lower end of each motor's range, within the limits of the URDF.");
  v.field("motor_upper_rad", hand.motor_upper_rad, config::Range{-7, 7},
          "Upper end of each motor's range, within the limits of the URDF.");
  v.choice("thumb_mode", hand.thumb_mode, kThumbModeNames, "Fixed pose of the thumb's opposition joint.");
  v.field("thumb_joint", hand.thumb_joint, "Opposition joint of the thumb; empty: the hand has none.");
  v.field("thumb_opposed_rad", hand.thumb_opposed_rad, config::Range{-7, 7}, "Its angle in mode opposed.");
  v.field("thumb_lateral_rad", hand.thumb_lateral_rad, config::Range{-7, 7}, "Its angle in mode lateral.");
  v.field("finger_zero_offset_rad", hand.finger_zero_offset_rad, config::Range{-1, 1},
          "Difference between the geometry's zero and the joint's zero: geometry angle = joint angle + offset.");
  v.field("zero_offset_joints", hand.zero_offset_joints, "Joints that have this offset.");
  constexpr std::array<const char*, kFingers> kDocs{"Thumb: the points that follow the human thumb.", "Index finger.",
                                                    "Middle finger.", "Ring finger.", "Little finger."};
  for (std::size_t i = 0; i < kFingers; ++i) v.section(kFingerNames[i], hand.fingers[i], kDocs[i]);
}

}  // namespace embody
