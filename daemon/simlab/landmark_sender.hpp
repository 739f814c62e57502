#pragma once
// A simulated tracker of hand landmarks: sends the datagrams of docs/landmarks.md at a steady rate.
#include <cstdint>
#include <string>

#include "daemon/app/signals.hpp"
#include "daemon/simlab/landmark_source.hpp"
#include "drivers/landmarks/landmark_tracker.hpp"

namespace embody::sim {

struct LandmarkSenderConfig {
  double rate_hz{30.0};
  std::string host{"127.0.0.1"};  ///< numeric IPv4
  std::uint16_t port{landmarks::kDefaultPort};
  bool loop{false};  ///< begin again after the last frame; frame numbers go on
};

struct LandmarkSenderReport {
  std::uint64_t sent{0};
  std::uint64_t unheard{0};  ///< of these: nobody received the one before
};

/// Sends `recording` until its end or until a signal. Nobody needs to listen. Errors: kInvalidArgument (host), kIo.
[[nodiscard]] Result<LandmarkSenderReport> send_landmarks(LandmarkRecording recording,
                                                          const LandmarkSenderConfig& config, StopSignals& signals);

}  // namespace embody::sim
