#pragma once
// What the control script should do, written a second time in C++: the oracle that the script is compared with, cycle
// by cycle. Pure.
#include "drivers/sim/ur/registers.hpp"
#include "drivers/ur_rtde/control_script.hpp"

namespace embody::sim {

struct OracleOutputs : RegisterOutputs {
  Vector6 q_rad{Vector6::Zero()};  ///< set-point of this cycle
  Vector6 qd_rad_s{Vector6::Zero()};
};

class RegisterOracle {
 public:
  explicit RegisterOracle(const rtde::ControlScriptConfig& config) noexcept : config_(config) {}

  /// Begins anew: at rest at `q_rad`, disarmed. `sequence` is what the register holds now, so that only a change
  /// counts.
  void start(const Vector6& q_rad, std::int32_t sequence) noexcept;

  /// One control cycle of length `dt` > 0.
  const OracleOutputs& step(const RegisterInputs& in, Duration dt) noexcept;

  [[nodiscard]] const OracleOutputs& outputs() const noexcept { return out_; }

 private:
  void update_freshness(std::int32_t sequence, Duration dt) noexcept;
  void accept_target(const RegisterInputs& in) noexcept;
  [[nodiscard]] ProgramFault check_target(const RegisterInputs& in) const noexcept;
  [[nodiscard]] double speed_towards(int joint, double distance_rad) const noexcept;
  void slew(double dt_s) noexcept;

  rtde::ControlScriptConfig config_;
  OracleOutputs out_;
  Vector6 target_{Vector6::Zero()};
  Vector6 feed_forward_{Vector6::Zero()};
  int age_{0};  ///< cycles without a new sequence
  bool fresh_{false};
  bool armed_{false};  ///< mode has been 0 since the last fault
};

}  // namespace embody::sim
