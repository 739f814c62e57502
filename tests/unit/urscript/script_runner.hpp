#pragma once
// The control script on an ideal robot: joints that are at their set-point at once.
#include <gtest/gtest.h>

#include "drivers/sim/ur/script_program.hpp"
#include "drivers/ur_rtde/control_script.hpp"

namespace embody::sim {

inline const Vector6 kStart{0.1, -1.2, 1.4, -1.5, -1.6, 0.3};
inline constexpr Duration kESeries = std::chrono::milliseconds(2);
inline constexpr Duration kCb3 = std::chrono::milliseconds(8);

class ScriptRunner {
 public:
  explicit ScriptRunner(const Vector6& q = kStart, const rtde::ControlScriptConfig& config = {},
                        Duration cycle = kESeries)
      : cycle_(cycle) {
    const auto text = rtde::control_script(config);
    if (!text) throw std::runtime_error(text.error().detail.c_str());
    auto created = ScriptProgram::create(*text, [](urscript::MessageKind, std::string_view) {});
    program_ = std::move(std::get<std::unique_ptr<ScriptProgram>>(created));
    robot_.q_rad = robot_.q_set_rad = q;
    program_->start(last_);
    starve();  // the stop at its beginning
  }

  urscript::Outcome step(const RegisterInputs& in) {
    last_ = in;
    const urscript::Outcome outcome = program_->step(in, robot_, cycle_);
    const RobotMotion& motion = program_->motion();
    if (motion.kind == RobotMotion::Kind::kServo) {
      robot_.qd_set_rad_s = (motion.servo.q_rad - robot_.q_set_rad) / to_seconds(cycle_);
      robot_.q_set_rad = motion.servo.q_rad;
    } else {
      robot_.qd_set_rad_s.setZero();
    }
    robot_.q_rad = robot_.q_set_rad;
    return outcome;
  }
  /// A command with a new sequence, in a new package.
  urscript::Outcome send(std::int32_t mode, const Vector6& q, const Vector6& qd = Vector6::Zero()) {
    return step({last_.sequence + 1, mode, q, qd, last_.packages + 1});
  }
  /// A cycle in which no package arrives.
  urscript::Outcome starve() { return step(last_); }
  /// A cycle with a package that repeats the last command: the sender's connection lives, the sender does not.
  urscript::Outcome repeat() {
    ++last_.packages;
    return step(last_);
  }
  void arm() {
    send(0, Vector6::Zero());
    send(1, q());
    ASSERT_EQ(out().state, ProgramState::kTracking);
  }
  /// Something else moved the arm.
  void displace(const Vector6& q) { robot_.q_set_rad = robot_.q_rad = q; }

  [[nodiscard]] const RegisterOutputs& out() const { return program_->registers(); }
  [[nodiscard]] const Vector6& q() const { return robot_.q_set_rad; }
  [[nodiscard]] const Vector6& qd() const { return robot_.qd_set_rad_s; }
  [[nodiscard]] double cycle_s() const { return to_seconds(cycle_); }
  [[nodiscard]] ScriptProgram& program() { return *program_; }

 private:
  Duration cycle_;
  std::unique_ptr<ScriptProgram> program_;
  RobotView robot_;
  RegisterInputs last_;
};

}  // namespace embody::sim
