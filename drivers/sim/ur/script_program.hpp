#pragma once
// A URScript program on the simulated robot: text, machine, and what connects both with registers and joints.
#include <functional>
#include <memory>
#include <variant>

#include "core/base/result.hpp"
#include "drivers/sim/ur/registers.hpp"
#include "drivers/sim/ur/urscript/machine.hpp"

namespace embody::sim {

/// What the robot shows its program in a cycle.
struct RobotView {
  Vector6 q_rad{Vector6::Zero()};
  Vector6 qd_rad_s{Vector6::Zero()};
  Vector6 q_set_rad{Vector6::Zero()};
  Vector6 qd_set_rad_s{Vector6::Zero()};
  double speed_scaling{1.0};
  double max_angle_rad{6.2832};
};

/// What the program asks of the joints in this cycle.
struct RobotMotion {
  enum class Kind : std::uint8_t { kNone, kServo, kStop };
  Kind kind{Kind::kNone};
  urscript::ServoCommand servo;     ///< of kServo
  double time_left_s{0.0};          ///< of the servoj call, in its own time
  double deceleration_rad_s2{0.0};  ///< of kStop
};

class ScriptProgram final : private urscript::ScriptHost {
 public:
  using Say = std::function<void(urscript::MessageKind, std::string_view)>;

  /// Errors of the text are returned in place of a program.
  [[nodiscard]] static std::variant<std::unique_ptr<ScriptProgram>, urscript::ScriptError> create(std::string_view text,
                                                                                                  Say say);

  /// From the first line. Registers keep what an earlier run wrote.
  void start(const RegisterInputs& in) noexcept;
  /// One control cycle. Allocates nothing. Ends by itself when its watchdog misses input packages.
  urscript::Outcome step(const RegisterInputs& in, const RobotView& robot, Duration dt) noexcept;

  [[nodiscard]] const RobotMotion& motion() const noexcept { return motion_; }
  [[nodiscard]] const RegisterOutputs& registers() const noexcept { return registers_; }
  void keep_registers(const RegisterOutputs& registers) noexcept { registers_ = registers; }
  [[nodiscard]] const urscript::ScriptError& error() const noexcept { return machine_.error(); }
  [[nodiscard]] const std::string& name() const noexcept { return code_.name; }
  [[nodiscard]] bool secondary() const noexcept { return code_.secondary; }
  /// The script line that the program is at.
  [[nodiscard]] int line() const noexcept { return machine_.line(); }
  /// No input package came in time: the program has ended, or wants to be paused.
  [[nodiscard]] bool watchdog_fired() const noexcept { return watchdog_.fired; }
  [[nodiscard]] bool wants_pause() const noexcept { return watchdog_.fired && !watchdog_.stop; }

 private:
  struct Watchdog {
    bool set{false};
    bool stop{false};  ///< end the program; pause it otherwise
    bool fired{false};
    double period_s{0.0};
    double silence_s{0.0};
    std::uint64_t packages{0};
  };

  ScriptProgram(urscript::Code code, Say say) : code_(std::move(code)), machine_(code_), say_(std::move(say)) {}
  void watch(std::uint64_t packages, double dt_s) noexcept;

  [[nodiscard]] double step_time_s() const noexcept override { return dt_s_; }
  [[nodiscard]] double speed_scaling() const noexcept override { return robot_.speed_scaling; }
  [[nodiscard]] bool at_rest() const noexcept override;
  [[nodiscard]] Vector6 joints(urscript::JointQuantity quantity) const noexcept override;
  [[nodiscard]] bool within_limits(const Vector6& q_rad) const noexcept override;
  [[nodiscard]] std::int32_t input_int(int address) const noexcept override;
  [[nodiscard]] double input_double(int address) const noexcept override;
  [[nodiscard]] bool input_bool(int) const noexcept override { return false; }
  void set_output_int(int address, std::int32_t value) noexcept override;
  void set_output_double(int, double) noexcept override {}
  void set_output_bool(int, bool) noexcept override {}
  void servoj(const urscript::ServoCommand& command) noexcept override;
  void stopj(double deceleration_rad_s2) noexcept override;
  void motion_done() noexcept override { motion_.kind = RobotMotion::Kind::kNone; }
  bool set_watchdog(std::string_view variable, double min_frequency_hz, bool stop) noexcept override;
  void message(urscript::MessageKind kind, std::string_view text) noexcept override { say_(kind, text); }

  urscript::Code code_;
  urscript::Machine machine_;
  Say say_;
  RegisterInputs in_;
  RegisterOutputs registers_;
  RobotView robot_;
  double dt_s_{0.002};
  RobotMotion motion_;
  Watchdog watchdog_;
};

}  // namespace embody::sim
