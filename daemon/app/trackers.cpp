#include "daemon/app/trackers.hpp"

#include "drivers/landmarks/landmark_tracker.hpp"
#include "drivers/qualisys/qualisys_tracker.hpp"

namespace embody {

std::unique_ptr<HandTracker> make_tracker(const config::EmbodyConfig& config) {
  if (config.tracker.driver == config::TrackerDriver::kLandmarks) {
    landmarks::LandmarkConfig landmarks;
    landmarks.address = config.tracker.landmarks.address;
    landmarks.port = static_cast<std::uint16_t>(config.tracker.landmarks.port);
    landmarks.rate_hz = config.tracker.landmarks.rate_hz;
    landmarks.side = config.subject.side;
    return std::make_unique<landmarks::LandmarkTracker>(landmarks);
  }
  qualisys::QualisysConfig qualisys;
  qualisys.host = config.tracker.host;
  qualisys.port = static_cast<std::uint16_t>(config.tracker.port);
  qualisys.allow_playback = config.tracker.allow_playback;
  return std::make_unique<qualisys::QualisysTracker>(qualisys, config.glove.names);
}

}  // namespace embody
