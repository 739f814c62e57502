#include "tests/unit/urscript/register_oracle.hpp"

#include <algorithm>
#include <cmath>

namespace embody::sim {

void RegisterOracle::start(const Vector6& q_rad, std::int32_t sequence) noexcept {
  out_ = {};
  out_.sequence = sequence;
  out_.state = ProgramState::kHold;
  out_.version = 1;
  out_.q_rad = target_ = q_rad;
  feed_forward_.setZero();
  fresh_ = false;
  armed_ = false;
  age_ = 1'000'000;
}

const OracleOutputs& RegisterOracle::step(const RegisterInputs& in, Duration dt) noexcept {
  update_freshness(in.sequence, dt);
  if (out_.state == ProgramState::kEnded || in.mode == 9) {
    out_.state = ProgramState::kEnded;
  } else if (in.mode != 1) {
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

void RegisterOracle::update_freshness(std::int32_t sequence, Duration dt) noexcept {
  const double stale_cycles = std::floor(to_seconds(config_.stale_after) / to_seconds(dt) + 0.5);
  age_ = sequence != out_.sequence ? 0 : age_ + 1;
  out_.sequence = sequence;
  fresh_ = age_ < stale_cycles;
}

void RegisterOracle::accept_target(const RegisterInputs& in) noexcept {
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

ProgramFault RegisterOracle::check_target(const RegisterInputs& in) const noexcept {
  ProgramFault fault = ProgramFault::kNone;
  for (int i = 0; i < 6; ++i) {
    const double q = in.q_target_rad[i];
    if (!(q >= config_.min_angle_rad[i] && q <= config_.max_angle_rad[i])) return ProgramFault::kOutOfRange;
    const bool arming = out_.state != ProgramState::kTracking;
    if (arming && !(std::abs(q - out_.q_rad[i]) < config_.arm_tolerance_rad)) fault = ProgramFault::kFarTarget;
  }
  return fault;
}

double RegisterOracle::speed_towards(int joint, double distance_rad) const noexcept {
  const double left = std::max(distance_rad, 0.0);
  const double braking = std::sqrt(config_.max_acceleration_rad_s2[joint] * left);
  return std::min(braking, config_.approach_gain_1_s * left);
}

// Approaches at most as fast as half of the acceleration can still brake (v^2 = 2 (a/2) d); the other half is left for
// the feed-forward velocity.
void RegisterOracle::slew(double dt_s) noexcept {
  for (int i = 0; i < 6; ++i) {
    const double v_max = config_.max_velocity_rad_s[i];
    const double dv_max = config_.max_acceleration_rad_s2[i] * dt_s;
    double wanted = 0.0;
    if (out_.state == ProgramState::kTracking) {
      const double left = target_[i] - out_.q_rad[i];
      const double approach = speed_towards(i, std::abs(left));
      wanted = std::clamp(std::copysign(approach, left) + feed_forward_[i], -v_max, v_max);
      wanted = std::min(wanted, speed_towards(i, config_.max_angle_rad[i] - out_.q_rad[i]));
      wanted = std::max(wanted, -speed_towards(i, out_.q_rad[i] - config_.min_angle_rad[i]));
    }
    out_.qd_rad_s[i] += std::clamp(wanted - out_.qd_rad_s[i], -dv_max, dv_max);
    out_.q_rad[i] += out_.qd_rad_s[i] * dt_s;
  }
}

}  // namespace embody::sim
