#pragma once
// Keys of a robot hand file (config/hands/*.toml): visits core's EmbodimentConfig, which knows no file format.
#include <array>

#include "core/embodiment/embodiment_config.hpp"
#include "daemon/app/config_field.hpp"

namespace embody {

inline constexpr std::array<const char*, 3> kThumbModeNames{"opposed", "lateral", "automatic"};

/// Visited by argument-dependent look-up; see config_field.hpp.
template <class V>
void visit_fields(V& v, ContactPad& pad) {
  v.field("link", pad.link, "URDF link that carries the pad.");
  v.field("from_m", pad.from_m, config::Range{-0.5, 0.5}, "End of the pad's axis nearer to the palm, in that link.");
  v.field("to_m", pad.to_m, config::Range{-0.5, 0.5}, "End of the axis nearer to the tip.");
  v.field("radius_m", pad.radius_m, config::Range{0.0, 0.1}, "Distance of the surface from the axis.");
  v.field("facing", pad.facing, config::Range{-1.0, 1.0}, "Where the pad looks: out of the finger, across the axis.");
  v.field("width_m", pad.width_m, config::Range{0.0, 0.2},
          "0: round, half of a capsule; else a flat rectangle of this width.");
}

template <class V>
void visit_fields(V& v, FingerPoints& points) {
  v.field("link", points.link, "URDF link that carries the tip point; empty: the hand has no such finger.");
  v.field("tip_m", points.tip_m, config::Range{-0.5, 0.5}, "Point that follows the human tip marker, in that link.");
  v.field("middle_link", points.middle_link, "URDF link that carries the middle point; empty: the same.");
  v.field("middle_m", points.middle_m, config::Range{-0.5, 0.5},
          "Point that follows the human middle marker, in that link.");
  v.list("pads", points.pads, "Palmar surface of the finger; the first pad is the finger tip's.");
}

template <class V>
void visit_fields(V& v, JointCoupling& coupling) {
  v.field("joint", coupling.joint, "URDF joint that follows.");
  v.field("motor", coupling.motor, "Motor that it follows.");
  v.field("motor_rad", coupling.motor_rad, config::Range{-7, 7}, "Increasing motor coordinates.");
  v.field("joint_rad", coupling.joint_rad, config::Range{-7, 7},
          "The joint's angle at each; linear in between, constant beyond.");
}

template <class V>
void visit_fields(V& v, EmbodimentConfig& hand) {
  v.field("name", hand.name, "Name of the robot hand, for people.");
  v.path("urdf", hand.urdf, "Robot description of the hand (URDF).");
  v.field("root_link", hand.root_link, "Root link of the URDF: frame P.");
  v.choice("side", hand.side, kSideNames, "Robot hand that is driven: the other side than file_side is mirrored.");
  v.choice("file_side", hand.file_side, kSideNames, "Side that the URDF and the numbers of this file describe.");
  v.field("X_PM", hand.X_PM, config::Range{-10, 10},
          "Pose of the hand model M in the root link P as exponential coordinates: three of rotation (rad), three of "
          "translation (m).");
  v.field("motors", hand.motors,
          "Coordinates of the hand driver, in its order: URDF joints, or names that couplings use.");
  v.field("motor_lower_rad", hand.motor_lower_rad, config::Range{-7, 7},
          "Lower end of each motor's range, within the limits of the URDF.");
  v.field("motor_upper_rad", hand.motor_upper_rad, config::Range{-7, 7},
          "Upper end of each motor's range, within the limits of the URDF.");
  v.list("couplings", hand.couplings, "Joints that follow a motor other than one to one; mimic joints need no entry.");
  v.choice("thumb_mode", hand.thumb_mode, kThumbModeNames, "Branch of the thumb's motor.");
  v.field("thumb_motor", hand.thumb_motor,
          "Motor whose positive half opposes the thumb and whose negative half brings it beside the index finger; "
          "empty: none.");
  v.field("thumb_opposed_from_rad", hand.thumb_opposed_from_rad, config::Range{0, 7},
          "Opposed, that motor stays above this: there its couplings have brought the thumb in front of the palm.");
  v.field("finger_zero_offset_rad", hand.finger_zero_offset_rad, config::Range{-1, 1},
          "Difference between the geometry's zero and the joint's zero: geometry angle = joint angle + offset.");
  v.field("zero_offset_joints", hand.zero_offset_joints, "Joints that have this offset.");
  v.field("orientation_m", hand.orientation_m, config::Range{0.0, 0.1},
          "Weight of the finger tips' directions: a radian costs as much as this distance. 0: off.");
  v.field("pinch_m", hand.pinch_m, config::Range{0.0, 0.1},
          "Below this distance of human thumb and finger their distance is kept, too. 0: off.");
  v.field("temporal_m_rad", hand.temporal_m_rad, config::Range{0.0, 0.1},
          "Weight of a motor's change in 10 ms where the points hardly tell its angle. 0: off.");
  v.field("collision_margin_m", hand.collision_margin_m, config::Range{0.0, 0.02},
          "Finger tips keep this distance from each other. 0: off.");
  constexpr std::array<const char*, kFingers> kDocs{"Thumb: the points that follow the human thumb.", "Index finger.",
                                                    "Middle finger.", "Ring finger.", "Little finger."};
  for (std::size_t i = 0; i < kFingers; ++i) v.section(kFingerNames[i], hand.fingers[i], kDocs[i]);
}

}  // namespace embody
