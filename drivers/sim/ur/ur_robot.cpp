#include "drivers/sim/ur/ur_robot.hpp"

#include <algorithm>
#include <cmath>

namespace embody::sim {
namespace {

using urscript::MessageKind;
using urscript::Outcome;

bool is_secondary(std::string_view text) noexcept {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  return begin != std::string_view::npos && text.substr(begin).starts_with("sec ");
}

}  // namespace

UrRobot::UrRobot(const UrRobotConfig& config)
    : config_(config), plant_(config.plant, config.q_start_rad), q_set_rad_(config.q_start_rad) {
  if (config.program_text == rtde::kControlScriptName) {
    const auto text = rtde::control_script(config.program);
    program_status_ = text ? load_program(*text) : Status(text.error());
  } else if (!config.program_text.empty()) {
    (void)load_program(config.program_text);
  }
  if (!program_) safety_.set_program_running(false);
}

void UrRobot::step(const RegisterInputs& in, Duration dt) noexcept {
  safety_.advance(dt);
  run_secondary(in, dt);
  run_program(in, dt);
  move(dt);
  watch_limits();
}

Status UrRobot::load_program(std::string_view text) {
  auto created = ScriptProgram::create(text, listener());
  if (const auto* const error = std::get_if<urscript::ScriptError>(&created)) {
    report(*error);
    if (!is_secondary(text)) {
      set_program_running(false);
      program_.reset();
    }
    return program_status_ = make_error(Errc::kMalformed, "line %d: %s", error->line, error->text.c_str());
  }
  auto program = std::move(std::get<std::unique_ptr<ScriptProgram>>(created));
  if (program->secondary()) {
    secondary_ = std::move(program);
    return program_status_ = Status{};
  }
  set_program_running(false);
  program_ = std::move(program);
  if (safety_.may_move()) set_program_running(true);
  return program_status_ = Status{};
}

std::string_view UrRobot::program_name() const noexcept {
  return program_ ? std::string_view(program_->name()) : std::string_view{};
}

int UrRobot::program_line() const noexcept {
  return program_ && safety_.playing() && !restart_ ? program_->line() : 0;
}

void UrRobot::clear_stop() noexcept {
  safety_.clear();
  restart_ = true;
  if (!program_) safety_.set_program_running(false);
}

void UrRobot::set_program_running(bool running) noexcept {
  if (running && !program_) return;
  if (running && !safety_.playing()) restart_ = true;
  const bool before = safety_.playing();
  safety_.set_program_running(running);
  if (before == safety_.playing() || !program_) return;
  const auto kind = running ? RobotText::Kind::kStarted : RobotText::Kind::kStopped;
  texts_.push({kind, 0, 0, 0, 0, program_name()});
}

void UrRobot::set_speed_fraction(double fraction) noexcept {
  if (std::isfinite(fraction)) speed_fraction_ = std::clamp(fraction, 0.0, 1.0);
}

RobotView UrRobot::view() const noexcept {
  return {plant_.q_rad(), plant_.qd_rad_s(), q_set_rad_, qd_set_rad_s_, speed_fraction_, config_.limits.max_angle_rad};
}

ScriptProgram::Say UrRobot::listener() {
  return [this](MessageKind kind, std::string_view text) {
    texts_.push({kind == MessageKind::kPopup ? RobotText::Kind::kPopup : RobotText::Kind::kText, 0, 0, 0, 0, text});
  };
}

void UrRobot::run_program(const RegisterInputs& in, Duration dt) noexcept {
  if (!safety_.playing()) return;
  if (!program_) return safety_.set_program_running(false);
  if (restart_) {
    program_->keep_registers(registers_);
    program_->start(in);
  }
  restart_ = false;
  const Outcome outcome = program_->step(in, view(), dt);
  registers_ = program_->registers();
  if (outcome != Outcome::kRunning) {
    end_program(outcome);
  } else if (program_->wants_pause()) {
    safety_.pause_program();
  }
}

// A secondary program has one cycle and cannot move anything.
void UrRobot::run_secondary(const RegisterInputs& in, Duration dt) noexcept {
  if (!secondary_) return;
  secondary_->keep_registers(registers_);
  secondary_->start(in);
  const Outcome outcome = secondary_->step(in, view(), dt);
  registers_ = secondary_->registers();
  if (program_) program_->keep_registers(registers_);
  if (outcome == Outcome::kRunning) {
    report({secondary_->line(), 1, "C271: a secondary program must end within its control cycle"});
  } else if (outcome != Outcome::kEnded) {
    report(secondary_->error());
  }
  secondary_.reset();
}

void UrRobot::end_program(Outcome outcome) noexcept {
  if (outcome != Outcome::kEnded) report(program_->error());
  if (program_->watchdog_fired()) {
    report({program_->line(), 1, "RTDE watchdog: no input packages, the program is stopped"});
  }
  set_program_running(false);
  if (outcome == Outcome::kTooMuchTime) stop_with(218, 0, "a thread used too much time");
}

void UrRobot::move(Duration dt) noexcept {
  static const RobotMotion kNoMotion;
  const RobotMotion& motion = safety_.playing() && program_ && !restart_ ? program_->motion() : kNoMotion;
  if (motion.kind == RobotMotion::Kind::kServo && advance_set_point(motion, dt)) {
    return plant_.follow(q_set_rad_, servo_lag(motion.servo.lookahead_s, motion.servo.gain), dt);
  }
  if (motion.kind == RobotMotion::Kind::kStop) {
    plant_.decelerate(motion.deceleration_rad_s2, dt);
  } else {
    plant_.brake(dt);
  }
  q_set_rad_ = plant_.q_rad();
  qd_set_rad_s_ = plant_.qd_rad_s();
}

/// The set-point goes evenly to the target of servoj, within the time of the call. False: it would jump.
bool UrRobot::advance_set_point(const RobotMotion& motion, Duration dt) noexcept {
  const double step_s = to_seconds(dt);
  const double part = std::clamp(step_s * speed_fraction_ / std::max(motion.time_left_s, 1e-12), 0.0, 1.0);
  const Vector6 next =
      part >= 1.0 - 1e-9 ? motion.servo.q_rad : Vector6(q_set_rad_ + part * (motion.servo.q_rad - q_set_rad_));
  const Vector6 step = next - q_set_rad_;
  const Vector6 longest = config_.limits.max_step_factor * step_s * config_.limits.max_speed_rad_s;
  if ((step.array().abs() > longest.array()).any()) {
    stop_with(204, 1, "sudden change of the target position");
    return false;
  }
  q_set_rad_ = next;
  qd_set_rad_s_ = step / step_s;
  return true;
}

void UrRobot::watch_limits() noexcept {
  if ((plant_.q_rad().array().abs() > config_.limits.max_angle_rad).any()) {
    stop_with(191, 1, "joint position outside its range");
  }
  if ((plant_.qd_rad_s().array().abs() > config_.limits.max_speed_rad_s.array()).any()) {
    stop_with(191, 2, "joint speed above its limit");
  }
}

void UrRobot::stop_with(int code, int argument, std::string_view text) noexcept {
  if (safety_.stopped()) return;
  texts_.push({RobotText::Kind::kStopCode, code, argument, 0, 0, text});
  safety_.protective_stop();
}

void UrRobot::report(const urscript::ScriptError& error) noexcept {
  texts_.push({RobotText::Kind::kException, 0, 0, error.line, error.column, error.text});
}

}  // namespace embody::sim
