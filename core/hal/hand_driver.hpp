#pragma once
// What the daemon needs of a robot hand, and nothing more.
#include "core/base/result.hpp"
#include "core/hal/device.hpp"
#include "core/hal/types.hpp"

namespace embody {

struct HandInfo {
  int fd{-1};           ///< readable when read() may have something
  double rate_hz{0.0};  ///< commands per second that the bus carries
  std::size_t joint_count{0};
  std::array<FixedString<40>, kMaxHandJoints> joint_names{};  ///< URDF names, in the order of FingerTarget::q_rad
  FixedString<120> peer;                                      ///< for people
};

/// A robot hand with position-controlled motors. One session at a time. connect() may block (at most about 5 s) and
/// allocate; read() and write() neither block nor allocate. Calls never overlap. Connecting never moves anything; the
/// destructor stops the motors.
class HandDriver : public Device {
 public:
  virtual ~HandDriver() = default;

  virtual Result<HandInfo> connect() = 0;
  /// Takes what the hand said since the last call; kDone when `state` is new.
  virtual IoStatus read(HandDeviceState& state) noexcept = 0;
  /// Starts the exchange of one cycle (targets, then a position request) unless the command has expired at `now`.
  virtual IoStatus write(const HandCommand& command, TimePoint now) noexcept = 0;
};

}  // namespace embody
