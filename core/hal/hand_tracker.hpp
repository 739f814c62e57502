#pragma once
// What the daemon needs of a hand tracker, and nothing more.
#include "core/base/result.hpp"
#include "core/hal/device.hpp"
#include "core/hal/types.hpp"

namespace embody {

struct TrackerInfo {
  int fd{-1};             ///< readable when read() may have something
  double rate_hz{0.0};    ///< nominal frame rate
  bool playback{false};   ///< a recording, not a live measurement
  FixedString<120> peer;  ///< for people
};

/// A source of marker frames. One session at a time. connect() and service() may block (at most about 5 s), allocate
/// and throw nothing; read() neither blocks nor allocates. Calls never overlap, except service() with read().
class HandTracker : public Device {
 public:
  virtual ~HandTracker() = default;

  /// Ends the present session, if any, and opens a new one. Every marker of the layout must be known to the sensor.
  virtual Result<TrackerInfo> connect() = 0;
  /// Slow upkeep about once a second while connected (label list, calibration); an error ends the session.
  virtual Status service() = 0;
  /// Next buffered frame in order of arrival; call until kEmpty.
  virtual IoStatus read(MarkerFrame& frame) noexcept = 0;
};

}  // namespace embody
