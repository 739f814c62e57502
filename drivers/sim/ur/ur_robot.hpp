#pragma once
// The simulated robot without its network: its script program, joints and safety, one cycle at a time. No clock, no
// I/O.
#include <optional>
#include <string>

#include "drivers/sim/ur/robot_texts.hpp"
#include "drivers/sim/ur/safety_machine.hpp"
#include "drivers/sim/ur/script_program.hpp"
#include "drivers/sim/ur/servo_plant.hpp"
#include "drivers/ur_rtde/control_script.hpp"

namespace embody::sim {

struct SafetyLimits {
  double max_angle_rad{6.2832};                    ///< protective stop beyond, each joint
  Vector6 max_speed_rad_s = 1.2 * kUr10eMaxSpeed;  ///< protective stop above
  double max_step_factor{2.0};  ///< protective stop C204A1 when a set-point steps by more than this times what
                                ///< max_speed_rad_s allows in a cycle; the real threshold is not published
};

struct UrRobotConfig {
  Vector6 q_start_rad{0.0, -1.5708, 1.5708, -1.5708, -1.5708, 0.0};
  rtde::ControlScriptConfig program;  ///< of the control script that runs from the beginning
  /// The script that runs at first; empty: none. By its mere name our control script, with the limits above.
  std::string program_text{rtde::kControlScriptName};
  ServoPlantConfig plant;
  SafetyLimits limits;
};

class UrRobot {
 public:
  explicit UrRobot(const UrRobotConfig& config);
  UrRobot(const UrRobot&) = delete;
  UrRobot& operator=(const UrRobot&) = delete;
  ~UrRobot() = default;

  /// One control cycle; allocates nothing. Without a playing program, in a stop, or while the program calls no motion,
  /// the joints brake; the output registers keep their values.
  void step(const RegisterInputs& in, Duration dt) noexcept;

  /// Replaces the program and starts it if the robot may move; otherwise it waits for set_program_running(true). A
  /// script that does not compile (kMalformed, with line and the controller's text) ends the present program, too. A
  /// secondary program ("sec ...") runs beside the present one in the next cycle.
  Status load_program(std::string_view text);
  /// Of the last load_program(), or of the program in the configuration.
  [[nodiscard]] const Status& program_status() const noexcept { return program_status_; }
  [[nodiscard]] bool has_program() const noexcept { return program_ != nullptr; }
  /// Empty without a program.
  [[nodiscard]] std::string_view program_name() const noexcept;
  /// Script line of a playing program, 0 otherwise.
  [[nodiscard]] int program_line() const noexcept;

  void protective_stop() noexcept { safety_.protective_stop(); }
  void emergency_stop() noexcept { safety_.emergency_stop(); }
  /// The program starts anew and needs mode 0, then 1.
  void clear_stop() noexcept;
  /// Starts the loaded program from its first line, or stops it.
  void set_program_running(bool running) noexcept;
  /// Speed slider, 0 to 1: all motion takes this much longer.
  void set_speed_fraction(double fraction) noexcept;
  [[nodiscard]] double speed_fraction() const noexcept { return speed_fraction_; }

  [[nodiscard]] const Vector6& q_rad() const noexcept { return plant_.q_rad(); }
  [[nodiscard]] const Vector6& qd_rad_s() const noexcept { return plant_.qd_rad_s(); }
  /// The controller's set-point: the program's, or the joints themselves when no program moves them.
  [[nodiscard]] const Vector6& q_target_rad() const noexcept { return q_set_rad_; }
  [[nodiscard]] const Vector6& qd_target_rad_s() const noexcept { return qd_set_rad_s_; }
  /// What the program has written into its output registers.
  [[nodiscard]] const RegisterOutputs& registers() const noexcept { return registers_; }
  [[nodiscard]] const SafetyStatus& safety() const noexcept { return safety_.status(); }
  [[nodiscard]] SafetyMachine& machine() noexcept { return safety_; }
  /// Messages of program and controller, oldest first.
  [[nodiscard]] std::optional<RobotText> next_text() noexcept { return texts_.pop(); }

 private:
  [[nodiscard]] RobotView view() const noexcept;
  [[nodiscard]] ScriptProgram::Say listener();
  void run_program(const RegisterInputs& in, Duration dt) noexcept;
  void run_secondary(const RegisterInputs& in, Duration dt) noexcept;
  void end_program(urscript::Outcome outcome) noexcept;
  void move(Duration dt) noexcept;
  bool advance_set_point(const RobotMotion& motion, Duration dt) noexcept;
  void watch_limits() noexcept;
  void stop_with(int code, int argument, std::string_view text) noexcept;
  void report(const urscript::ScriptError& error) noexcept;

  UrRobotConfig config_;
  SafetyMachine safety_;
  ServoPlant plant_;
  std::unique_ptr<ScriptProgram> program_;
  std::unique_ptr<ScriptProgram> secondary_;
  Status program_status_;
  RobotTexts texts_;
  RegisterOutputs registers_;
  Vector6 q_set_rad_;
  Vector6 qd_set_rad_s_{Vector6::Zero()};
  double speed_fraction_{1.0};
  bool restart_{true};  ///< the program begins anew in the next cycle
};

}  // namespace embody::sim
