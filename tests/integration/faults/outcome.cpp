#include "tests/integration/faults/outcome.hpp"

#include <algorithm>
#include <cmath>

namespace embody::faults {
namespace {

using std::chrono::milliseconds;

constexpr double kRest_rad_s = 0.01;
constexpr Duration kNotice = milliseconds(50);  // hold_after, and the same of the program on the robot
// From the last set-point at speed to joints at rest. A critically damped follower with servo_lag() = 55 ms (look-ahead
// 0.05 s, gain 600) behind a set-point that brakes at a = 4 rad/s^2 and then stands still has
// |qd| = a (0.055 s + t) exp(-2 t / 0.055 s), below 0.01 rad/s after 0.12 s; 0.02 s are the way of a command and the
// last approach to it of the program on the robot.
constexpr Duration kServojLag = milliseconds(140);
constexpr Duration kRobotStop = milliseconds(300);  // of the simulated controller

/// v is the greatest speed of each joint, or of its set-point which runs ahead of it, until the fault is noticed.
Duration bound_of(const Timeline& line, const CellLimits& limits, bool robot_brakes, Duration notice) {
  if (robot_brakes) return kRobotStop;
  Vector6 v = Vector6::Zero();
  for (std::size_t i = 1; i < line.arm.size(); ++i) {
    const sim::UrSample& a = line.arm[i - 1];
    const sim::UrSample& b = line.arm[i];
    if (a.t < line.t_fault || b.t > line.t_fault + notice) continue;
    v = v.cwiseMax(b.qd_rad_s.cwiseAbs());
    v = v.cwiseMax((b.q_target_rad - a.q_target_rad).cwiseAbs() / to_seconds(b.t - a.t));
  }
  return notice + from_seconds(v.cwiseQuotient(limits.acceleration_rad_s2).maxCoeff()) + kServojLag;
}

double largest_way(const sim::UrSample& a, const sim::UrSample& b) {
  return (b.q_rad - a.q_rad).cwiseAbs().maxCoeff();
}

void judge_speed(const Timeline& line, const CellLimits& limits, ArmOutcome& outcome) {
  const auto share = [&limits](const Vector6& speed) {
    return speed.cwiseAbs().cwiseQuotient(limits.speed_rad_s).maxCoeff();
  };
  for (std::size_t i = 1; i < line.arm.size(); ++i) {
    const sim::UrSample& a = line.arm[i - 1];
    const sim::UrSample& b = line.arm[i];
    outcome.worst_speed = std::max(outcome.worst_speed, share(b.qd_rad_s));
    outcome.worst_step = std::max(outcome.worst_step, share((b.q_rad - a.q_rad) / to_seconds(b.t - a.t)));
  }
}

}  // namespace

ArmOutcome judge_arm(const Timeline& line, const CellLimits& limits, bool robot_brakes, Duration detected) {
  ArmOutcome outcome;
  const TimePoint t_end = line.t_engaged.value_or(TimePoint::max());
  const sim::UrSample* fault = nullptr;  // the last sample before it
  const sim::UrSample* rest = nullptr;   // the first one of a rest that lasts
  for (const sim::UrSample& s : line.arm) {
    const double speed = s.qd_rad_s.cwiseAbs().maxCoeff();
    if (s.t < line.t_fault) {
      fault = &s;
      outcome.speed_rad_s = speed;
    }
    if (fault == nullptr || s.t < line.t_fault || s.t >= t_end) continue;
    if (s.t < line.t_cleared) outcome.travel_rad = std::max(outcome.travel_rad, largest_way(*fault, s));
    if (speed >= kRest_rad_s) {
      rest = nullptr;
      outcome.moved_at_rest_rad = 0.0;
    } else if (rest == nullptr) {
      rest = &s;
    } else {
      outcome.moved_at_rest_rad = std::max(outcome.moved_at_rest_rad, largest_way(*rest, s));
    }
  }
  if (rest != nullptr) outcome.to_rest = rest->t - line.t_fault;
  outcome.bound = bound_of(line, limits, robot_brakes, std::max(kNotice, detected));
  judge_speed(line, limits, outcome);
  return outcome;
}

HandOutcome judge_hand(const Timeline& line, TimePoint t_end) {
  constexpr double kStill_rad = 1e-3;
  constexpr Duration kLastCommands = milliseconds(200);  // may be under way until the driver knows
  HandOutcome outcome;
  const HandSample* last_command = nullptr;
  const HandSample* last = nullptr;
  for (const HandSample& s : line.hand) {
    if (s.t >= t_end) break;
    if (last == nullptr || s.motions != last->motions) last_command = &s;
    if (last_command == &s && s.t > line.t_fault + kLastCommands) outcome.commanded = true;
    last = &s;
  }
  for (const HandSample& s : line.hand) {
    if (s.t < last_command->t || s.t > last->t) continue;
    for (std::size_t i = 0; i < s.q_rad.size(); ++i) {
      outcome.excursion_rad = std::max(outcome.excursion_rad, std::abs(s.q_rad[i] - last_command->q_rad[i]));
      if (std::abs(s.q_rad[i] - last->q_rad[i]) > kStill_rad) outcome.to_rest = s.t - line.t_fault;
    }
  }
  return outcome;
}

std::optional<Duration> time_to_detect(const Timeline& line) {
  const Shown* before = nullptr;
  for (const Shown& now : line.shown) {
    if (now.mode == kNoAnswer) continue;
    if (now.t > line.t_fault && before != nullptr && now.t < line.t_cleared) {
      const bool mode = now.mode != before->mode || now.cause != before->cause;
      if (mode) return std::max(Duration{0}, now.t - from_seconds(now.since_s) - line.t_fault);
      if (now.evidence != before->evidence) return now.t - line.t_fault;
    }
    if (before == nullptr || now.t <= line.t_fault) before = &now;
  }
  return std::nullopt;
}

}  // namespace embody::faults
