#pragma once
// The simulated robot without its network: control program, joints and safety, one cycle at a time. Pure.
#include "drivers/sim/ur/register_program.hpp"
#include "drivers/sim/ur/safety_machine.hpp"
#include "drivers/sim/ur/servo_plant.hpp"

namespace embody::sim {

struct SafetyLimits {
  double max_angle_rad{6.2832};                    ///< protective stop beyond, each joint
  Vector6 max_speed_rad_s = 1.2 * kUr10eMaxSpeed;  ///< protective stop above
};

struct UrRobotConfig {
  Vector6 q_start_rad{0.0, -1.5708, 1.5708, -1.5708, -1.5708, 0.0};
  RegisterProgramConfig program;
  ServoPlantConfig plant;
  SafetyLimits limits;
};

class UrRobot {
 public:
  explicit UrRobot(const UrRobotConfig& config) noexcept;

  /// One control cycle. Without a playing program, or in a stop, the joints brake and the registers keep their values.
  void step(const RegisterInputs& in, Duration dt) noexcept;

  void protective_stop() noexcept { safety_.protective_stop(); }
  void emergency_stop() noexcept { safety_.emergency_stop(); }
  /// The program starts anew and needs mode 0, then 1.
  void clear_stop() noexcept;
  void set_program_running(bool running) noexcept;

  [[nodiscard]] const Vector6& q_rad() const noexcept { return plant_.q_rad(); }
  [[nodiscard]] const Vector6& qd_rad_s() const noexcept { return plant_.qd_rad_s(); }
  /// The controller's set-point: the program's, or the joints themselves when no program moves them.
  [[nodiscard]] const Vector6& q_target_rad() const noexcept;
  [[nodiscard]] const Vector6& qd_target_rad_s() const noexcept;
  /// What the program has written into its output registers.
  [[nodiscard]] const RegisterOutputs& registers() const noexcept { return program_.outputs(); }
  [[nodiscard]] const SafetyStatus& safety() const noexcept { return safety_.status(); }

 private:
  void watch_limits() noexcept;
  [[nodiscard]] bool program_moves() const noexcept;

  UrRobotConfig config_;
  RegisterProgram program_;
  ServoPlant plant_;
  SafetyMachine safety_;
  bool restart_{true};  ///< the program begins anew in the next cycle
};

}  // namespace embody::sim
