#include "drivers/qualisys/event_rules.hpp"

namespace embody::qualisys {

EventEffect effect_of(Event event, bool allow_playback) noexcept {
  switch (event) {
    case Event::kConnectionClosed:
    case Event::kCalibrationStarted:
    case Event::kCalibrationStopped:
    case Event::kShuttingDown:
    case Event::kReprocessingStarted:
    case Event::kReprocessingStopped:
      return EventEffect::kEnd;
    case Event::kPlaybackStarted:
      return allow_playback ? EventEffect::kDoubt : EventEffect::kEnd;
    case Event::kCaptureStarted:
    case Event::kCaptureStopped:
    case Event::kPlaybackStopped:
    case Event::kCameraSettingsChanged:
      return EventEffect::kDoubt;
    case Event::kConnected:
    case Event::kWaitingForTrigger:
    case Event::kCaptureSaved:
    case Event::kTrigger:
      break;
  }
  return EventEffect::kNone;
}

const char* describe(Event event) noexcept {
  switch (event) {
    case Event::kConnected:
      return "has connected its cameras";
    case Event::kConnectionClosed:
      return "has closed the connection to its cameras";
    case Event::kCaptureStarted:
      return "has started a capture";
    case Event::kCaptureStopped:
      return "has stopped its capture";
    case Event::kCalibrationStarted:
      return "is calibrating its cameras";
    case Event::kCalibrationStopped:
      return "has finished a calibration";
    case Event::kPlaybackStarted:
      return "plays back a recording; measure live, or allow playback in the tracker's configuration";
    case Event::kPlaybackStopped:
      return "has stopped playing back";
    case Event::kWaitingForTrigger:
      return "waits for a trigger";
    case Event::kCameraSettingsChanged:
      return "has changed its camera settings";
    case Event::kShuttingDown:
      return "is shutting down";
    case Event::kCaptureSaved:
      return "has saved its capture";
    case Event::kReprocessingStarted:
      return "reprocesses a recording";
    case Event::kReprocessingStopped:
      return "has finished reprocessing";
    case Event::kTrigger:
      return "was triggered";
  }
  return "told an unknown event";
}

bool is_measuring(Event state) noexcept {
  // Playback may be paused for as long as somebody likes.
  return state == Event::kConnected || state == Event::kCaptureStarted;
}

}  // namespace embody::qualisys
