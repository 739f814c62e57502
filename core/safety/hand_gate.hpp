#pragma once
// The last word on robot finger motion: bounded joint speed, from where the hand is, and only towards what is known.
#include "core/hal/types.hpp"
#include "core/safety/mode_machine.hpp"

namespace embody::safety {

struct HandGateConfig {
  double speed_rad_s{2.0};
  Duration mode_timeout{std::chrono::milliseconds(100)};    ///< an older ModeState counts as holding
  Duration target_timeout{std::chrono::milliseconds(500)};  ///< an older finger target is not followed
  double min_confidence{0.0};                               ///< 0..1: what is less sure than this is not followed
  /// A command is at most this far from where its joint is measured to be: by that a hand without a watchdog goes on
  /// when its line is cut, or when what blocked it gives way. 0.15 rad less what hands round to.
  double lead_rad{0.14};
  Duration measured_timeout{std::chrono::milliseconds(150)};  ///< angles that are older say nothing: no motion
};

/// Why the hand does not move.
enum class HandHold : std::uint8_t {
  kNone,         ///< it moves
  kModeStale,    ///< the arm loop is late or dead
  kMode,         ///< not engaged
  kNoAnswer,     ///< the robot hand has not told lately where its joints are
  kNotSeen,      ///< no valid finger target: the pose of the human hand is not known
  kTargetStale,  ///< the newest finger target is too old
  kUnsure,       ///< confidence in the back of the human hand is below min_confidence
};
/// One short phrase for people; empty for kNone.
[[nodiscard]] const char* to_string(HandHold hold) noexcept;

/// Turns finger targets into hand commands, one per bus cycle.
class HandGate {
 public:
  explicit HandGate(const HandGateConfig& config) noexcept : config_(config) {}

  /// Only an engaged, current mode and a current, sure target move the hand; motion starts from the measured angles.
  /// A joint whose own confidence is below the limit keeps its last sure target while the others go on.
  /// `stopped` modes yield kStop, everything else kHold; after a kStop the first command that is none is a kHold, since
  /// that is what opens a driver's latch. sequence and t_expires are left to the caller.
  [[nodiscard]] HandCommand step(TimePoint now, double dt_s, const ModeState& mode, const FingerTarget& target,
                                 const HandDeviceState& measured) noexcept;

  /// Why the last command does not move the hand.
  [[nodiscard]] HandHold hold() const noexcept { return hold_; }
  /// Bit i: in the last command, joint i kept an earlier target because the present one is not sure.
  [[nodiscard]] std::uint32_t kept_joints() const noexcept { return kept_joints_; }

 private:
  [[nodiscard]] HandHold obstacle(TimePoint now, const ModeState& mode, const FingerTarget& target,
                                  const HandDeviceState& measured) const noexcept;
  /// Written so that a confidence that is not a number is not sure.
  [[nodiscard]] bool sure(double confidence) const noexcept { return confidence >= config_.min_confidence; }

  HandGateConfig config_;
  bool following_{false};
  bool stopped_{false};  // the last command was kStop
  HandHold hold_{HandHold::kNoAnswer};
  std::uint32_t kept_joints_{0};
  std::array<double, kMaxHandJoints> goal_rad_{};  // newest sure targets
  std::array<double, kMaxHandJoints> q_rad_{};
};

}  // namespace embody::safety
