#include "core/hand/glove_layout.hpp"

namespace embody::hand {

GloveLayout paper_glove() noexcept {
  constexpr std::array<const char*, 13> kNames{
      "hand_top",   "hand_left",     "hand_right", "thumb_tip",   "thumb_middle", "index_tip",    "index_middle",
      "middle_tip", "middle_middle", "ring_tip",   "ring_middle", "little_tip",   "little_middle"};
  GloveLayout glove;
  for (const char* name : kNames) glove.names.push_back(name);
  for (std::size_t i = 0; i < 2 * kFingers; ++i) {
    glove.finger_markers.push_back({static_cast<Finger>(i / 2), i % 2, 3 + i});
  }
  return glove;
}

Pose paper_calibration() noexcept {
  Vector6 S;
  S << .1795496537, 1.6513870904, -.1843735310, -.0658988406, -.0238788252, .0873064542;
  return math::exp_se3(S);
}

}  // namespace embody::hand
