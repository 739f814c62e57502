#pragma once
// Modes of the simulated controller: normal, protective stop, emergency stop, and whether its program plays. Pure.
// Codes are those of the RTDE guide.
#include <cstdint>

namespace embody::sim {

struct SafetyStatus {
  std::int32_t robot_mode{7};             ///< running
  std::int32_t safety_status{1};          ///< normal
  std::uint32_t runtime_state{2};         ///< playing
  std::uint32_t robot_status_bits{0b11};  ///< power on, program running
  std::uint32_t safety_status_bits{1};    ///< normal mode
};

class SafetyMachine {
 public:
  /// Ignored during an emergency stop.
  void protective_stop() noexcept;
  void emergency_stop() noexcept;
  /// Unlocks, powers and restarts the program: everything as after start-up.
  void clear() noexcept;
  /// Starts or stops the program. Starting is refused during a stop.
  void set_program_running(bool running) noexcept;

  [[nodiscard]] bool playing() const noexcept { return status_.runtime_state == 2; }
  [[nodiscard]] bool stopped() const noexcept { return status_.safety_status != 1; }
  [[nodiscard]] const SafetyStatus& status() const noexcept { return status_; }

 private:
  SafetyStatus status_;
};

}  // namespace embody::sim
