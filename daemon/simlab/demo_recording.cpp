#include "daemon/simlab/demo_recording.hpp"

#include "core/hand/synthetic_motion.hpp"

namespace embody::sim {

recording::Recording make_demo_recording(double duration_s, std::uint64_t seed) {
  const hand::SyntheticMotionConfig config{100.0, duration_s, seed};
  const hand::SyntheticMotion motion(config);
  const hand::GloveLayout glove = hand::paper_glove();
  recording::Recording recording;
  recording.rate_hz = config.rate_hz;
  recording.source = "embody-sim generate";
  for (const auto& name : glove.names) recording.marker_names.emplace_back(name.view());
  for (std::size_t k = 0; k < motion.frame_count(); ++k) {
    const MarkerFrame frame = motion.frame(k).markers;
    recording.frames.emplace_back(frame.markers.begin(),
                                  frame.markers.begin() + static_cast<std::ptrdiff_t>(glove.names.size()));
  }
  return recording;
}

}  // namespace embody::sim
