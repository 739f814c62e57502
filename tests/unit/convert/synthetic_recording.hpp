#pragma once
// The made-up motion of the demo as a recording, with an object of three markers beside it; and models that fit it.
#include <gtest/gtest.h>

#include <functional>

#include "core/hand/synthetic_motion.hpp"
#include "daemon/app/config_io.hpp"
#include "daemon/app/models.hpp"
#include "drivers/recording/recording.hpp"

namespace embody::test {

/// Moves everything that is seen at a time: applied to all markers of the frame, m.
using Mover = std::function<math::Pose(double time_s)>;

inline recording::Recording synthetic_recording(std::size_t count, const Mover& mover = {}) {
  const hand::SyntheticMotion motion;
  recording::Recording recording;
  recording.rate_hz = 100.0;
  recording.source = "synthetic.tsv";
  for (const auto& name : hand::paper_glove().names) recording.marker_names.emplace_back(name.view());
  for (const char* name : {"box_origin", "box_x", "box_y"}) recording.marker_names.emplace_back(name);
  for (std::size_t k = 0; k < count; ++k) {
    const MarkerFrame frame = motion.frame(k).markers;
    const math::Pose X = mover ? mover(static_cast<double>(k) / recording.rate_hz) : math::Pose::Identity();
    auto& markers = recording.frames.emplace_back(frame.markers.begin(), frame.markers.begin() + 13);
    markers.push_back({{0.4, 0.1, 0.02}, true});
    markers.push_back({{0.4, 0.3, 0.02}, true});
    markers.push_back({{0.3, 0.2, 0.07}, true});
    for (Marker& marker : markers) marker.p_W = X * marker.p_W;
  }
  return recording;
}

/// Of the shipped configuration: the paper's glove and the Mia hand.
inline const Models& shipped_models() {
  static const Models models = [] {
    const auto config = config::load_config(EMBODY_SOURCE_DIR "/config/embody.toml");
    if (!config) throw std::runtime_error(std::string(config.error().detail.view()));
    auto made = make_models(*config);
    if (!made) throw std::runtime_error(std::string(made.error().detail.view()));
    return std::move(*made);
  }();
  return models;
}

}  // namespace embody::test
