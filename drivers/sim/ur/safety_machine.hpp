#pragma once
// Modes of the simulated controller: power, brakes, stops and what releases them, whether its program plays. Pure; time
// passes by advance(). Codes are those of the RTDE guide; durations and the state after an emergency stop are
// estimates.
#include <cstdint>

#include "core/base/fixed_string.hpp"
#include "core/base/time.hpp"

namespace embody::sim {

struct SafetyStatus {
  std::int32_t robot_mode{7};             ///< running
  std::int32_t safety_status{1};          ///< normal
  std::uint32_t runtime_state{2};         ///< playing
  std::uint32_t robot_status_bits{0b11};  ///< power on, program running
  std::uint32_t safety_status_bits{1};    ///< normal mode
};

struct SafetyTimes {
  Duration boot{std::chrono::seconds(2)};            ///< power on to "power on"
  Duration power{std::chrono::seconds(2)};           ///< "power on" to idle
  Duration brakes{std::chrono::milliseconds(1500)};  ///< brake release to running
  Duration unlock{std::chrono::seconds(5)};          ///< a protective stop lasts at least this long
  bool safeguard_resumes{true};                      ///< the program goes on when a safeguard closes
};

class SafetyMachine {
 public:
  void set_times(const SafetyTimes& times) noexcept { times_ = times; }
  void advance(Duration dt) noexcept;

  // --- what happens to a robot
  /// Ignored during a graver stop.
  void protective_stop() noexcept;
  void emergency_stop() noexcept;
  /// The button is unlocked: safety is normal, the power stays off.
  void release_emergency_stop() noexcept;
  void safeguard_stop(bool open) noexcept;
  void fault() noexcept;
  void violation() noexcept;
  /// Unlocks, powers and restarts the program: everything as after start-up.
  void clear() noexcept;

  // --- what an operator asks for; false: refused in this mode
  bool power_on() noexcept;
  bool power_off() noexcept;
  bool release_brakes() noexcept;
  /// Refused without a protective stop, and during its first 5 s. The program stays paused.
  bool unlock_protective_stop() noexcept;
  /// After a violation or a fault: normal, power off.
  bool restart_safety() noexcept;
  bool pause_program() noexcept;

  /// Starts or stops the program. Starting is refused during a stop and without power.
  void set_program_running(bool running) noexcept;
  void set_remote(bool remote) noexcept { remote_ = remote; }
  /// 0 to 1, clamped; what is not finite is ignored.
  void set_speed_slider(double fraction) noexcept;
  void show_popup(std::string_view text) noexcept { popup_ = text; }

  [[nodiscard]] bool playing() const noexcept { return status_.runtime_state == 2; }
  [[nodiscard]] bool stopped() const noexcept { return status_.safety_status != 1; }
  /// Powered, brakes released, no stop: a program may start.
  [[nodiscard]] bool may_move() const noexcept { return status_.robot_mode == 7 && !stopped(); }
  [[nodiscard]] bool remote() const noexcept { return remote_; }
  [[nodiscard]] const FixedString<200>& popup() const noexcept { return popup_; }  ///< empty: none is shown
  /// All motion takes this much longer.
  [[nodiscard]] double speed_slider() const noexcept { return speed_slider_; }
  [[nodiscard]] const SafetyStatus& status() const noexcept { return status_; }

 private:
  void stop(std::int32_t safety_status, std::uint32_t bits) noexcept;
  void cut_power() noexcept;
  void back_to_normal() noexcept;
  void set_runtime(std::uint32_t state) noexcept;

  SafetyTimes times_;
  SafetyStatus status_;
  Duration in_mode_{0};  ///< since the last change of the robot's mode or safety
  bool releasing_brakes_{false};
  bool resume_{false};  ///< the program plays on when the safeguard closes
  bool remote_{true};
  double speed_slider_{1.0};
  FixedString<200> popup_;
};

}  // namespace embody::sim
