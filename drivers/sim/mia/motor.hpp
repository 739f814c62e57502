#pragma once
// One simulated motor of a Mia hand: exact solution of its first-order model, for any step in time.
#include "drivers/mia/transmission.hpp"

namespace embody::sim {

/// Position mode: approaches the target with a time constant of `lag_s`, never faster than the commanded speed.
/// Speed mode: the speed follows its command with the same lag. The ends of the range stop it.
/// Source: speeds and reductions of Prensilia's published drivers; the lag is an assumption.
class MiaMotor {
 public:
  MiaMotor() = default;
  MiaMotor(mia::Motor motor, double counts, double lag_s) noexcept;

  /// 100 percent are 90 units of the vendor.
  void move_to(double target_counts, int speed_percent) noexcept;
  /// `speed` in units of the vendor, positive closes.
  void drive(double speed) noexcept;
  /// Stands still at once: the reduction does not let the finger drive the motor.
  void halt() noexcept;
  /// @pre dt_s >= 0
  void advance(double dt_s) noexcept;

  [[nodiscard]] double counts() const noexcept { return counts_; }
  [[nodiscard]] double counts_per_s() const noexcept { return rate_; }
  /// Speed in units of the vendor.
  [[nodiscard]] double speed() const noexcept { return rate_ / counts_per_s_per_unit_; }
  /// Pushing against an end of the range.
  [[nodiscard]] bool blocked() const noexcept { return blocked_; }

 private:
  enum class Mode : unsigned char { kHalted, kPosition, kSpeed };
  void approach(double dt_s) noexcept;
  void coast(double dt_s) noexcept;

  double counts_per_s_per_unit_{1.0};
  double min_counts_{0.0};
  double lag_s_{0.04};
  Mode mode_{Mode::kHalted};
  double counts_{0.0};
  double target_{0.0};
  double limit_{0.0};  ///< counts/s
  double command_{0.0};
  double rate_{0.0};
  bool blocked_{false};
};

}  // namespace embody::sim
