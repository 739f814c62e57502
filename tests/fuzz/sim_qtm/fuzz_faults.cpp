// Any text as a fault and as a fault script: refused with a sentence, or a studio that goes on making frames of the
// promised shape under it.
#include <cstdint>
#include <cstdlib>

#include "drivers/sim/qtm/studio.hpp"

namespace {

using namespace embody;
using namespace embody::sim;

Motion motion() {
  Motion motion;
  motion.rate_hz = 100.0;
  motion.marker_names = {"a", "b", "c", "d"};
  motion.frames = 10;
  motion.generate = [](std::size_t frame, std::span<Marker> markers) {
    for (std::size_t i = 0; i < markers.size(); ++i) {
      markers[i] = {Eigen::Vector3d(i == 0 ? 0.1 : 0.0, i == 1 ? 0.1 : 0.0, 0.01 * static_cast<double>(frame)), true};
    }
  };
  return motion;
}

void play(Studio& studio, const std::vector<ScheduledFault>& script) {
  std::size_t next = 0;
  for (int step = 0; step < 20; ++step) {
    for (; next < script.size() && script[next].frame <= studio.tick(); ++next) {
      if (Studio::handles(script[next].fault.kind)) (void)studio.act(script[next].fault, TimePoint{});
    }
    if (studio.step() != Studio::Step::kFrame) continue;
    const FrameData& frame = studio.frame();
    if (frame.markers.size() != studio.setup().labels.size() || frame.markers.empty()) std::abort();
    if (frame.bodies.size() != 1 || frame.markers.size() > Motion::kMaxMarkers) std::abort();
    const std::vector<Component> components{Component::k3dResidual, Component::k3dNoLabels,
                                            Component::k6dEulerResidual};
    if (encode_frame(frame, components, ByteOrder::kLittle).size() > (std::size_t{1} << 16)) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  QtmServerConfig config;
  config.loop = true;
  config.bodies = {{"hand", {"a", "b", "c"}, BodyFrame::kMarkers}};
  auto studio = Studio::build(config, motion());
  if (!studio) std::abort();
  (void)studio->measurement().begin();
  studio->start(TimePoint{});
  if (const auto fault = parse_qtm_fault(text); !fault) {
    if (fault.error().detail.empty()) std::abort();
  } else if (Studio::handles(fault->kind)) {
    (void)studio->act(*fault, TimePoint{});
  }
  const auto script = parse_fault_script(text, 100.0);
  if (!script) {
    if (script.error().detail.view().find("script") == std::string_view::npos) std::abort();
    play(*studio, {});
    return 0;
  }
  // A script that passes the check finds every name.
  const bool sound = studio->check(*script).ok();
  for (const auto& scheduled : *script) {
    if (scheduled.line == 0 || scheduled.frame > 1'000'000'000) std::abort();
  }
  (void)sound;
  play(*studio, *script);
  return 0;
}
