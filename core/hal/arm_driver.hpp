#pragma once
// What the daemon needs of a robot arm, and nothing more.
#include "core/base/result.hpp"
#include "core/hal/device.hpp"
#include "core/hal/types.hpp"

namespace embody {

struct ArmInfo {
  int fd{-1};             ///< readable when read() may have something
  double rate_hz{0.0};    ///< packages per second = commands per second
  FixedString<120> peer;  ///< for people
};

/// A six-joint arm that streams states and takes one joint target per state. One session at a time. connect() and
/// service() may block (at most about 5 s) and allocate; read() and write() neither block nor allocate. Calls never
/// overlap, except service() with read() and write(). Connecting never moves anything; the destructor ends the session
/// so that the arm stands still.
class ArmDriver : public Device {
 public:
  virtual ~ArmDriver() = default;

  virtual Result<ArmInfo> connect() = 0;
  /// Slow upkeep about once a second while connected: sees to it that the robot has our control program, which stands
  /// still until commands come. An error is a sentence for the operator and does not end the session.
  virtual Status service() = 0;
  /// Next buffered package in order of arrival; call until kEmpty.
  virtual IoStatus read(ArmState& state) noexcept = 0;
  /// Sends `command` unless it has expired at `now`.
  virtual IoStatus write(const ArmCommand& command, TimePoint now) noexcept = 0;
};

}  // namespace embody
