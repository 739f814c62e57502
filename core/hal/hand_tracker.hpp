#pragma once
// What the daemon needs of a hand tracker, and nothing more.
#include <string_view>

#include "core/base/result.hpp"
#include "core/hal/types.hpp"

namespace embody {

enum class IoStatus {
  kDone,          ///< one item was read, or the command was handed to the kernel
  kEmpty,         ///< nothing complete to read, or the kernel's buffer is full (the command is dropped: newest wins)
  kRefused,       ///< the command has expired or is not finite; nothing was sent
  kDisconnected,  ///< the session is over: only connect() helps
};

struct TrackerInfo {
  int fd{-1};             ///< readable when read() may have something
  double rate_hz{0.0};    ///< nominal frame rate
  bool playback{false};   ///< a recording, not a live measurement
  FixedString<120> peer;  ///< for people
};

/// A source of marker frames. One session at a time. connect() and service() may block (at most about 5 s), allocate
/// and throw nothing; read() neither blocks nor allocates. Calls never overlap, except service() with read().
class HandTracker {
 public:
  HandTracker() = default;
  HandTracker(const HandTracker&) = delete;
  HandTracker& operator=(const HandTracker&) = delete;
  virtual ~HandTracker() = default;

  /// Ends the present session, if any, and opens a new one. Every marker of the layout must be known to the sensor.
  virtual Result<TrackerInfo> connect() = 0;
  /// Slow upkeep about once a second while connected (label list, calibration); an error ends the session.
  virtual Status service() = 0;
  /// Next buffered frame in order of arrival; call until kEmpty.
  virtual IoStatus read(MarkerFrame& frame) noexcept = 0;
  /// Why the last session ended, for people; empty while it lasts. Call it from the owner of the driver.
  [[nodiscard]] virtual std::string_view reason() const noexcept = 0;
};

}  // namespace embody
