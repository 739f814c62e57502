#pragma once
// The latched stop of a hand on CAN, as a state machine without clock and I/O.
// request() latches before anything is sent. Then: stop to all motors, up to four times until acknowledged; if it never
// is, stop to each motor by itself. The latch opens only for a motion after a hold, once the exchange is over.
#include <cstdint>
#include <optional>

#include "drivers/mia/compact/codec.hpp"

namespace embody::mia::compact {

class StopSequence {
 public:
  /// Latches. Starts the exchange unless it is under way or has been acknowledged; true when it starts.
  bool request() noexcept;
  /// The operator's side is quiet.
  void hold() noexcept { hold_seen_ = latched_; }
  [[nodiscard]] bool may_resume() const noexcept { return !latched_ || (hold_seen_ && !busy()); }
  void resume() noexcept { *this = {}; }
  /// A new acknowledgement is wanted whatever was said before.
  void forget() noexcept { acknowledged_ = false; }

  [[nodiscard]] bool latched() const noexcept { return latched_; }
  [[nodiscard]] bool busy() const noexcept { return phase_ != Phase::kOver; }
  [[nodiscard]] bool acknowledged() const noexcept { return acknowledged_; }
  /// Whom the next stop goes to: a motor, or kAllMotors. @pre busy()
  [[nodiscard]] std::uint8_t target() const noexcept;
  /// The stop to target() was acknowledged, or was not in time.
  void finish(bool acknowledged) noexcept;

 private:
  enum class Phase : std::uint8_t { kOver, kAll, kEach };
  static constexpr int kTries = 4;

  bool latched_{false};
  bool hold_seen_{false};
  bool acknowledged_{false};
  Phase phase_{Phase::kOver};
  int tries_{0};
  std::uint8_t motor_{0};
  std::size_t motors_acknowledged_{0};
};

}  // namespace embody::mia::compact
