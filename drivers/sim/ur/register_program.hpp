#pragma once
// The robot's control program: what the registers of the arm driver do, cycle by cycle (docs/ur_rtde.md). Pure.
//
// Rules that keep the arm safe from whatever is in the registers:
//  - arming needs mode 0 first, then mode 1 with a changing sequence and a target near the commanded joints;
//  - a sequence that stands still for `stale_after` ends tracking: the joints brake, and mode 0 is needed again;
//  - each joint's velocity and acceleration are bounded, so that no register value can cause a jump;
//  - numbers that are not finite never pass a comparison.
#include "core/hal/types.hpp"

namespace embody::sim {

struct RegisterInputs {
  std::int32_t sequence{0};                  ///< int 24
  std::int32_t mode{0};                      ///< int 25: 0 hold, 1 track, 9 exit; others hold without arming
  Vector6 q_target_rad{Vector6::Zero()};     ///< double 24-29
  Vector6 qd_target_rad_s{Vector6::Zero()};  ///< double 30-35, feed-forward
};

enum class ProgramState : std::int32_t { kBoot = 0, kHold = 1, kTracking = 2, kStale = 3, kEnded = 9 };

/// Fault codes, kept until mode 0.
enum class ProgramFault : std::int32_t { kNone = 0, kStale = 1, kFarTarget = 2, kOutOfRange = 4, kNoInverse = 8 };

struct RegisterOutputs {
  std::int32_t sequence{0};                 ///< int 24: newest sequence seen
  ProgramState state{ProgramState::kBoot};  ///< int 25
  ProgramFault fault{ProgramFault::kNone};  ///< int 26
  std::int32_t version{0};                  ///< int 27
  Vector6 q_rad{Vector6::Zero()};           ///< set-point of this cycle
  Vector6 qd_rad_s{Vector6::Zero()};
};

struct RegisterProgramConfig {
  Vector6 max_velocity_rad_s{1.0, 1.0, 1.5, 2.0, 2.0, 2.0};
  Vector6 max_acceleration_rad_s2{4.0, 4.0, 6.0, 10.0, 10.0, 10.0};
  double approach_gain_1_s{30.0};  ///< final approach, velocity per distance
  double arm_tolerance_rad{0.10};  ///< largest distance of the first target, per joint
  double max_target_rad{6.2};      ///< targets beyond are refused
  Duration stale_after{std::chrono::milliseconds(50)};
};

class RegisterProgram {
 public:
  explicit RegisterProgram(const RegisterProgramConfig& config) noexcept : config_(config) {}

  /// Begins anew: at rest at `q_rad`, disarmed. `sequence` is what the register holds now, so that only a change
  /// counts.
  void start(const Vector6& q_rad, std::int32_t sequence) noexcept;

  /// One control cycle of length `dt` > 0.
  const RegisterOutputs& step(const RegisterInputs& in, Duration dt) noexcept;

  [[nodiscard]] const RegisterOutputs& outputs() const noexcept { return out_; }

 private:
  void update_freshness(std::int32_t sequence, Duration dt) noexcept;
  void accept_target(const RegisterInputs& in) noexcept;
  [[nodiscard]] ProgramFault check_target(const RegisterInputs& in) const noexcept;
  void slew(double dt_s) noexcept;

  RegisterProgramConfig config_;
  RegisterOutputs out_;
  Vector6 target_{Vector6::Zero()};
  Vector6 feed_forward_{Vector6::Zero()};
  Duration age_{0};
  bool fresh_{false};
  bool armed_{false};  ///< mode has been 0 since the last fault
};

}  // namespace embody::sim
