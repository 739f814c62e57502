#include "core/embodiment/mirror_config.hpp"

#include "core/robot/mirror.hpp"

namespace embody {

EmbodimentConfig mirrored(const EmbodimentConfig& config) {
  EmbodimentConfig out = config;
  out.file_side = config.file_side == Side::kRight ? Side::kLeft : Side::kRight;
  out.X_PM = robot::mirrored_exponential(config.X_PM);
  for (FingerPoints& finger : out.fingers) {
    finger.tip_m = robot::mirrored(finger.tip_m);
    finger.middle_m = robot::mirrored(finger.middle_m);
    for (ContactPad& pad : finger.pads) {
      pad.from_m = robot::mirrored(pad.from_m);
      pad.to_m = robot::mirrored(pad.to_m);
      pad.facing = robot::mirrored(pad.facing);
    }
  }
  return out;
}

}  // namespace embody
