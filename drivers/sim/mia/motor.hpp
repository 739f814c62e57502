#pragma once
// One simulated motor of a Mia hand: exact solution of its first-order model, for any step in time.
#include <algorithm>
#include <limits>

#include "drivers/mia/transmission.hpp"

namespace embody::sim {

/// Position mode: approaches the target with a time constant of `lag_s`, never faster than the commanded speed.
/// Speed mode: the speed follows its command with the same lag. The ends of the range stop it, and so does a contact.
/// Where the motor is and what its counter says are two things: a restart of the hand sets the counter to zero.
/// Source: speeds and reductions of Prensilia's published drivers; lag, contact and restart are assumptions.
class MiaMotor {
 public:
  MiaMotor() = default;
  MiaMotor(mia::Motor motor, double counts, double lag_s) noexcept;

  /// To `target_counts` of the counter. 100 percent are 90 units of the vendor.
  void move_to(double target_counts, int speed_percent) noexcept;
  /// `speed` in units of the vendor, positive closes.
  void drive(double speed) noexcept;
  /// Stands still at once: the reduction does not let the finger drive the motor.
  void halt() noexcept;
  /// @pre dt_s >= 0
  void advance(double dt_s) noexcept;

  /// The hand restarts: the motor stands still, its counter is zero wherever it stands.
  void lose_counter() noexcept;
  /// Opens, wherever the counter believes to be.
  void begin_calibration(int speed_percent) noexcept;
  /// The counter tells the truth again.
  void end_calibration() noexcept { zero_ = 0.0; }

  /// Something is in the way of closing further than `counts`, or than where the motor is; infinity: nothing is.
  void set_contact(double counts) noexcept { contact_ = std::max(counts, counts_); }
  /// Stuck where it is.
  void set_stalled(bool on) noexcept { stalled_ = on; }

  [[nodiscard]] double counts() const noexcept { return counts_; }           ///< where it is
  [[nodiscard]] double counter() const noexcept { return counts_ - zero_; }  ///< what it reports
  [[nodiscard]] double counts_per_s() const noexcept { return rate_; }
  /// Speed in units of the vendor.
  [[nodiscard]] double speed() const noexcept { return rate_ / counts_per_s_per_unit_; }
  [[nodiscard]] double counts_per_s_per_unit() const noexcept { return counts_per_s_per_unit_; }
  /// Pushing against an end of the range, a contact, or whatever it is stuck in.
  [[nodiscard]] bool blocked() const noexcept { return blocked_; }

 private:
  enum class Mode : unsigned char { kHalted, kPosition, kSpeed };
  void approach(double dt_s) noexcept;
  void coast(double dt_s) noexcept;
  void stay_inside(bool pushing) noexcept;

  double counts_per_s_per_unit_{1.0};
  double min_counts_{0.0};
  double lag_s_{0.04};
  Mode mode_{Mode::kHalted};
  double counts_{0.0};
  double zero_{0.0};    ///< counts_ at which the counter says zero
  double target_{0.0};  ///< a place, like counts_
  double limit_{0.0};   ///< counts/s
  double command_{0.0};
  double rate_{0.0};
  double contact_{std::numeric_limits<double>::infinity()};
  bool stalled_{false};
  bool blocked_{false};
};

}  // namespace embody::sim
