#pragma once
// Judges the cyclic states of the three motors: what is new, what was lost, who has fallen silent. No clock, no I/O.
#include <array>
#include <optional>

#include "core/base/time.hpp"
#include "drivers/mia/compact/codec.hpp"

namespace embody::mia::compact {

class StateWatch {
 public:
  /// Nothing known; silence counts from `now`.
  void reset(TimePoint now) noexcept;
  /// Takes a state that arrived at `t`. One whose counter does not move on is old news, however often it comes.
  void take(std::size_t motor, const State& state, TimePoint t) noexcept;

  /// Every motor has said something new since the last take_set().
  [[nodiscard]] bool complete() const noexcept;
  /// Ends a set; returns when its oldest state arrived.
  TimePoint take_set() noexcept;

  /// The motor whose last news is older than `timeout` at `now`.
  [[nodiscard]] std::optional<std::size_t> silent(TimePoint now, Duration timeout) const noexcept;
  [[nodiscard]] const State& state(std::size_t motor) const noexcept { return motors_[motor].state; }
  [[nodiscard]] std::array<double, kMotors> counts() const noexcept;
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
  [[nodiscard]] std::uint64_t repeated() const noexcept { return repeated_; }

 private:
  struct Motor {
    State state;
    TimePoint t{};
    bool known{false};
    bool fresh{false};
  };
  std::array<Motor, kMotors> motors_{};
  std::uint64_t lost_{0};
  std::uint64_t repeated_{0};
};

}  // namespace embody::mia::compact
