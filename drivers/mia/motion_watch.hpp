#pragma once
// Could the hand have moved there? Finds restarts of the hand (its counters begin at zero again) and broken digits (the
// protocol has no checksum), and tells when it stands still. Pure, no clock.
//
// That a hand zeroes its counters when its supply fails is an assumption: the vendor's driver only says that it
// restarts.
#include <array>

#include "core/base/time.hpp"
#include "drivers/mia/transmission.hpp"

namespace embody::mia {

class MotionWatch {
 public:
  enum class Verdict : std::uint8_t {
    kPlausible,
    kImplausible,  ///< throw this reading away
    kRestarted,    ///< it was repeated: the counters are not what they were
  };

  /// Speed that was commanded, percent; readings up to twice as fast are believed.
  explicit MotionWatch(int speed_percent) noexcept;

  /// First reading of a session. True when it looks as if the hand had restarted since the last one.
  bool begin(const std::array<double, kMotors>& counts, TimePoint now) noexcept;
  /// `motor` was sent to `counts`, whether it heard that or not.
  void told(std::size_t motor, double counts) noexcept;
  /// All motors were told to stop.
  void told_to_stop() noexcept;
  Verdict take(const std::array<double, kMotors>& counts, TimePoint now) noexcept;

  /// No motor moved by more than a count for 150 ms up to the last reading.
  [[nodiscard]] bool still() const noexcept { return t_last_ - t_reference_ >= kStillTime; }

 private:
  static constexpr Duration kStillTime = std::chrono::milliseconds(150);
  enum class Course : std::uint8_t { kUnknown, kToTarget, kStopping, kStopped };
  struct MotorCourse {
    Course course{Course::kUnknown};
    double target{0.0};
    double least{0.0}, most{0.0};  ///< of the targets since the last reading and the one in force then
  };

  [[nodiscard]] bool off_course(std::size_t motor, double counts, double slack) const noexcept;
  [[nodiscard]] bool plausible(const std::array<double, kMotors>& counts, Duration elapsed) const noexcept;
  [[nodiscard]] bool zeroed(const std::array<double, kMotors>& counts, Duration elapsed) const noexcept;
  void accept(const std::array<double, kMotors>& counts, TimePoint now) noexcept;

  double speed_percent_;
  bool known_{false};  ///< last_ is a reading
  std::array<double, kMotors> last_{};
  TimePoint t_last_{};
  std::array<double, kMotors> reference_{};  ///< since when the hand stands still
  TimePoint t_reference_{};
  std::array<MotorCourse, kMotors> courses_{};
  std::array<double, kMotors> doubtful_{};  ///< last implausible reading
  int implausible_in_a_row_{0};
};

}  // namespace embody::mia
