#include "drivers/sim/ur/ur_robot.hpp"

namespace embody::sim {
namespace {

const Vector6 kAtRest = Vector6::Zero();

}  // namespace

UrRobot::UrRobot(const UrRobotConfig& config) noexcept
    : config_(config), program_(config.program), plant_(config.plant, config.q_start_rad) {}

void UrRobot::step(const RegisterInputs& in, Duration dt) noexcept {
  if (safety_.playing()) {
    if (restart_) program_.start(plant_.q_rad(), in.sequence);
    restart_ = false;
    program_.step(in, dt);
    if (program_.outputs().state == ProgramState::kEnded) safety_.set_program_running(false);
  }
  if (program_moves()) {
    plant_.follow(program_.outputs().q_rad, dt);
  } else {
    plant_.brake(dt);
  }
  watch_limits();
}

void UrRobot::clear_stop() noexcept {
  safety_.clear();
  restart_ = true;
}

void UrRobot::set_program_running(bool running) noexcept {
  if (running && !safety_.playing()) restart_ = true;
  safety_.set_program_running(running);
}

const Vector6& UrRobot::q_target_rad() const noexcept {
  return program_moves() ? program_.outputs().q_rad : plant_.q_rad();
}

const Vector6& UrRobot::qd_target_rad_s() const noexcept {
  return program_moves() ? program_.outputs().qd_rad_s : kAtRest;
}

void UrRobot::watch_limits() noexcept {
  const bool outside = (plant_.q_rad().array().abs() > config_.limits.max_angle_rad).any();
  const bool too_fast = (plant_.qd_rad_s().array().abs() > config_.limits.max_speed_rad_s.array()).any();
  if (outside || too_fast) safety_.protective_stop();
}

bool UrRobot::program_moves() const noexcept {
  return safety_.playing() && !restart_;
}

}  // namespace embody::sim
