#pragma once
// How well an arm follows a sine and a step: the same measure in virtual time and over TCP.
#include <span>

#include "core/hal/types.hpp"

namespace embody::test {

/// All joints swing together about `centre_rad`; the amplitude grows smoothly from zero, so that nothing jumps.
struct Sine {
  Vector6 centre_rad{Vector6::Zero()};
  double amplitude_rad{0.3};
  double frequency_hz{0.5};
  double growth_s{2.0};

  /// @param t_s since the beginning; before it the sine stands at its centre
  [[nodiscard]] Vector6 q_rad(double t_s) const;
  [[nodiscard]] Vector6 qd_rad_s(double t_s) const;
};

/// The robot in one control cycle.
struct CycleSample {
  double t_s{0.0};  ///< since the beginning of the motion
  Vector6 q_target_rad{Vector6::Zero()};
  Vector6 q_rad{Vector6::Zero()};
  Vector6 qd_rad_s{Vector6::Zero()};
};

struct SineFollowing {
  double target_error_rad{0.0};      ///< largest, set-point of the control program against the command, any joint
  double target_error_p99_rad{0.0};  ///< the same, 99th percentile of the cycles
  double lag_s{0.0};                 ///< the one delay that explains the joints best, 0 to 0.2
  double joint_error_rad{0.0};       ///< largest, actual joints against the command `lag_s` ago
  double joint_error_p99_rad{0.0};
};

/// Judges samples after the growth of the amplitude. @pre there are some.
[[nodiscard]] SineFollowing judge_sine(std::span<const CycleSample> samples, const Sine& sine);

struct StepFollowing {
  Vector6 speed_rad_s{Vector6::Zero()};          ///< largest actual, each joint
  Vector6 acceleration_rad_s2{Vector6::Zero()};  ///< largest actual, from the differences of neighbouring cycles
  Vector6 overshoot_rad{Vector6::Zero()};        ///< of the joints beyond their goal
  double settled_s{-1.0};                        ///< when all joints came within 1 mrad for good; -1: never
};

/// @param samples of neighbouring cycles, `cycle_s` apart; a missing cycle is left out of the acceleration
[[nodiscard]] StepFollowing judge_step(std::span<const CycleSample> samples, const Vector6& start_rad,
                                       const Vector6& goal_rad, double cycle_s);

}  // namespace embody::test
