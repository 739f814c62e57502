#pragma once
// Stopping a Mia hand: latched before anything is sent, repeated until somebody heard it. No I/O, no clock.
#include <optional>

#include "drivers/mia/exchange.hpp"

namespace embody::mia {

/// Acknowledging firmware: the stop command up to four times until it is acknowledged, then zero speed to each motor
/// (for firmware that does not know the stop command; harmless otherwise). Streaming firmware: zero speed to each
/// motor, three times over, because nobody tells what arrived.
class StopSequence {
 public:
  /// A new session: nothing is latched.
  void begin(bool acknowledging) noexcept;
  /// Latches. Starts the sequence unless it is under way or was heard. True when it started.
  bool request() noexcept;
  /// Starts the sequence although it was heard: the hand still moves.
  void repeat() noexcept;
  /// The hand stands still after the sequence: it was heard.
  void confirm() noexcept { heard_ = true; }
  /// While latched: the owner wants to hold, which allows a motion after that to open the latch.
  void hold() noexcept { hold_seen_ = latched_; }
  /// Opens the latch. @pre may_open()
  void open() noexcept;

  /// It was acknowledged, or the hand stands still.
  [[nodiscard]] bool heard() const noexcept { return heard_; }
  [[nodiscard]] bool latched() const noexcept { return latched_; }
  /// Nothing is left to send.
  [[nodiscard]] bool over() const noexcept { return phase_ == Phase::kOver; }
  [[nodiscard]] bool may_open() const noexcept { return hold_seen_ && over(); }

  /// The next step. @pre !over()
  [[nodiscard]] Outgoing next() noexcept;
  /// The step that next() gave is done.
  void finish(bool acknowledged) noexcept;

 private:
  enum class Phase : std::uint8_t { kOver, kStopAll, kZeroSpeed };
  void start() noexcept;

  bool acknowledging_{true};
  bool latched_{false};
  bool hold_seen_{false};
  bool heard_{false};
  Phase phase_{Phase::kOver};
  int tries_{0};
  std::size_t motor_{0};
  int rounds_left_{0};
  std::size_t zero_speed_acks_{0};
};

}  // namespace embody::mia
