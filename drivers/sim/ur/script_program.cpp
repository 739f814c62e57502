#include "drivers/sim/ur/script_program.hpp"

#include <utility>

#include "drivers/sim/ur/urscript/compiler.hpp"

namespace embody::sim {

using urscript::JointQuantity;
using urscript::Outcome;

std::variant<std::unique_ptr<ScriptProgram>, urscript::ScriptError> ScriptProgram::create(std::string_view text,
                                                                                          Say say) {
  auto compiled = urscript::compile(text);
  if (const auto* const error = std::get_if<urscript::ScriptError>(&compiled)) return *error;
  return std::unique_ptr<ScriptProgram>(
      new ScriptProgram(std::move(std::get<urscript::Code>(compiled)), std::move(say)));
}

void ScriptProgram::start(const RegisterInputs& in) noexcept {
  in_ = in;
  motion_ = {};
  watchdog_ = {};
  machine_.start();
}

Outcome ScriptProgram::step(const RegisterInputs& in, const RobotView& robot, Duration dt) noexcept {
  in_ = in;
  robot_ = robot;
  dt_s_ = to_seconds(dt);
  watch(in.packages, dt_s_);
  if (watchdog_.fired) {
    motion_ = {};
    return watchdog_.stop ? Outcome::kEnded : Outcome::kRunning;
  }
  motion_.time_left_s -= dt_s_ * robot_.speed_scaling;
  const Outcome outcome = machine_.cycle(*this);
  if (outcome != Outcome::kRunning) motion_ = {};
  return outcome;
}

// The watchdog counts packages, not changed values. It begins with the first package that anybody sends.
void ScriptProgram::watch(std::uint64_t packages, double dt_s) noexcept {
  if (!watchdog_.set || packages == 0) return;
  watchdog_.silence_s = packages == watchdog_.packages ? watchdog_.silence_s + dt_s : 0.0;
  watchdog_.packages = packages;
  watchdog_.fired = watchdog_.silence_s > watchdog_.period_s + 1e-9;
}

bool ScriptProgram::at_rest() const noexcept {
  return robot_.qd_rad_s.cwiseAbs().maxCoeff() < 1e-9;
}

Vector6 ScriptProgram::joints(JointQuantity quantity) const noexcept {
  switch (quantity) {
    case JointQuantity::kActualPosition:
      return robot_.q_rad;
    case JointQuantity::kActualSpeed:
      return robot_.qd_rad_s;
    case JointQuantity::kTargetPosition:
      return robot_.q_set_rad;
    case JointQuantity::kTargetSpeed:
      break;
  }
  return robot_.qd_set_rad_s;
}

bool ScriptProgram::within_limits(const Vector6& q_rad) const noexcept {
  return (q_rad.array().abs() <= robot_.max_angle_rad).all();
}

// Other registers are not connected and read as 0.
std::int32_t ScriptProgram::input_int(int address) const noexcept {
  if (address == 24) return in_.sequence;
  return address == 25 ? in_.mode : 0;
}

double ScriptProgram::input_double(int address) const noexcept {
  if (address >= 24 && address < 30) return in_.q_target_rad[address - 24];
  return address >= 30 && address < 36 ? in_.qd_target_rad_s[address - 30] : 0.0;
}

void ScriptProgram::set_output_int(int address, std::int32_t value) noexcept {
  if (address == 24) registers_.sequence = value;
  if (address == 25) registers_.state = static_cast<ProgramState>(value);
  if (address == 26) registers_.fault = static_cast<ProgramFault>(value);
  if (address == 27) registers_.version = value;
}

void ScriptProgram::servoj(const urscript::ServoCommand& command) noexcept {
  motion_ = {RobotMotion::Kind::kServo, command, command.time_s, 0.0};
}

void ScriptProgram::stopj(double deceleration_rad_s2) noexcept {
  motion_ = {RobotMotion::Kind::kStop, {}, 0.0, deceleration_rad_s2};
}

bool ScriptProgram::set_watchdog(std::string_view variable, double min_frequency_hz, bool stop) noexcept {
  if (!variable.starts_with("input_")) return false;
  watchdog_ = {true, stop, false, 1.0 / min_frequency_hz, 0.0, in_.packages};
  return true;
}

}  // namespace embody::sim
