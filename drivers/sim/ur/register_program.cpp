#include "drivers/sim/ur/register_program.hpp"

#include <algorithm>
#include <cmath>

namespace embody::sim {

void RegisterProgram::start(const Vector6& q_rad, std::int32_t sequence) noexcept {
  out_ = {};
  out_.sequence = sequence;
  out_.state = ProgramState::kHold;
  out_.version = 1;
  out_.q_rad = target_ = q_rad;
  feed_forward_.setZero();
  fresh_ = false;
  armed_ = false;
  age_ = config_.stale_after;
}

const RegisterOutputs& RegisterProgram::step(const RegisterInputs& in, Duration dt) noexcept {
  update_freshness(in.sequence, dt);
  if (out_.state == ProgramState::kEnded || in.mode == 9) {
    out_.state = ProgramState::kEnded;
  } else if (in.mode != 1 && in.mode != 2) {
    armed_ = in.mode == 0;
    out_.state = ProgramState::kHold;
    out_.fault = ProgramFault::kNone;
  } else if (!fresh_) {
    if (out_.state == ProgramState::kTracking) out_.fault = ProgramFault::kStale;
    out_.state = ProgramState::kStale;
    armed_ = false;
  } else if (armed_ || out_.state == ProgramState::kTracking) {
    accept_target(in);
  }
  slew(to_seconds(dt));
  return out_;
}

void RegisterProgram::update_freshness(std::int32_t sequence, Duration dt) noexcept {
  age_ = sequence != out_.sequence ? Duration{0} : std::min(age_ + dt, config_.stale_after);
  out_.sequence = sequence;
  fresh_ = age_ < config_.stale_after;
}

void RegisterProgram::accept_target(const RegisterInputs& in) noexcept {
  const ProgramFault fault = check_target(in);
  if (fault != ProgramFault::kNone) {
    out_.fault = fault;
    feed_forward_.setZero();  // tracking goes on towards the last good target
    armed_ = false;
    return;
  }
  out_.state = ProgramState::kTracking;
  target_ = in.q_target_rad;
  for (int i = 0; i < 6; ++i) {
    const double speed = in.qd_target_rad_s[i];
    feed_forward_[i] = std::abs(speed) < config_.max_velocity_rad_s[i] ? speed : 0.0;
  }
}

ProgramFault RegisterProgram::check_target(const RegisterInputs& in) const noexcept {
  if (in.mode == 2) return ProgramFault::kNoInverse;  // pose targets need the robot's own inverse kinematics
  ProgramFault fault = ProgramFault::kNone;
  for (int i = 0; i < 6; ++i) {
    const double q = in.q_target_rad[i];
    if (!(std::abs(q) < config_.max_target_rad)) return ProgramFault::kOutOfRange;
    const bool arming = out_.state != ProgramState::kTracking;
    if (arming && !(std::abs(q - out_.q_rad[i]) < config_.arm_tolerance_rad)) fault = ProgramFault::kFarTarget;
  }
  return fault;
}

// Approaches at most as fast as half of the acceleration can still brake (v^2 = 2 (a/2) d); the other half is left for
// the feed-forward velocity.
void RegisterProgram::slew(double dt_s) noexcept {
  for (int i = 0; i < 6; ++i) {
    const double v_max = config_.max_velocity_rad_s[i];
    const double dv_max = config_.max_acceleration_rad_s2[i] * dt_s;
    double wanted = 0.0;
    if (out_.state == ProgramState::kTracking) {
      const double left = target_[i] - out_.q_rad[i];
      const double braking = std::sqrt(config_.max_acceleration_rad_s2[i] * std::abs(left));
      const double approach = std::min(braking, config_.approach_gain_1_s * std::abs(left));
      wanted = std::clamp(std::copysign(approach, left) + feed_forward_[i], -v_max, v_max);
    }
    out_.qd_rad_s[i] += std::clamp(wanted - out_.qd_rad_s[i], -dv_max, dv_max);
    out_.q_rad[i] += out_.qd_rad_s[i] * dt_s;
  }
}

}  // namespace embody::sim
