#pragma once
// The last word on robot finger motion: bounded joint speed, from where the hand is.
#include "core/hal/types.hpp"
#include "core/safety/mode_machine.hpp"

namespace embody::safety {

struct HandGateConfig {
  double speed_rad_s{2.0};
  Duration mode_timeout{std::chrono::milliseconds(100)};    ///< an older ModeState counts as holding
  Duration target_timeout{std::chrono::milliseconds(500)};  ///< an older finger target is not followed
};

/// Turns finger targets into hand commands, one per bus cycle.
class HandGate {
 public:
  explicit HandGate(const HandGateConfig& config) noexcept : config_(config) {}

  /// Only an engaged, current mode and a current target move the hand; motion starts from the measured angles.
  /// `stopped` modes yield kStop, everything else kHold. sequence and t_expires are left to the caller.
  [[nodiscard]] HandCommand step(TimePoint now, double dt_s, const ModeState& mode, const FingerTarget& target,
                                 const HandDeviceState& measured) noexcept;

 private:
  HandGateConfig config_;
  bool following_{false};
  std::array<double, kMaxHandJoints> q_rad_{};
};

}  // namespace embody::safety
