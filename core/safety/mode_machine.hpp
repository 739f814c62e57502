#pragma once
// Which motion is allowed: a pure function of (time, state, request, health), stepped once per arm tick.
#include <cstdint>

#include "core/base/time.hpp"
#include "core/hal/types.hpp"

namespace embody::safety {

enum class Mode : std::uint8_t {
  kOffline,   ///< a device is missing
  kIdle,      ///< everything connected and measured, nothing commanded
  kAligned,   ///< all checks pass: ready to engage
  kEngaged,   ///< the robot follows the hand
  kCoasting,  ///< engaged, but the input is late: braking, may still go on
  kHolding,   ///< still; only the operator leads back to engaged
  kStopped,   ///< a fault or the operator's stop: still; leaving needs a reset
};

enum class Cause : std::uint8_t {
  kNone,
  kOperator,
  kTrackerStale,
  kTrackerLost,
  kTargetUnreachable,
  kArmLost,
  kArmNotReady,
  kArmProgramStopped,
  kArmNotFollowing,
  kProtectiveStop,
  kEmergencyStop,
  kArmFault,
  kHandLost,
  kHandPoseJumped,
  kWatchdog,
  kShutdown,
  kRequestExpired,
};

[[nodiscard]] const char* to_string(Mode mode) noexcept;
/// One short phrase for people.
[[nodiscard]] const char* to_string(Cause cause) noexcept;

enum class RequestKind : std::uint8_t { kEngage, kDisengage, kStop, kReset, kShutdown };

struct Request {
  RequestKind kind{RequestKind::kStop};
  std::uint32_t id{0};    ///< chosen by the sender, returned in ModeState
  TimePoint t_expires{};  ///< engage and reset are refused after this; the default never expires
};

/// What the loops know at this tick.
struct Health {
  bool tracker_connected{false};
  TimePoint t_pose{};             ///< capture time of the newest valid, plausible hand pose
  std::uint32_t fresh_streak{0};  ///< consecutive valid, plausible poses up to now
  bool arm_connected{false};
  ArmCondition arm{ArmCondition::kUnknown};
  bool arm_following{true};  ///< false: engaged, but the robot's program does not track
  bool arm_at_rest{true};    ///< our own set-point stands still
  bool hand_connected{false};
  bool hand_jumped{false};       ///< since engaging, the hand pose made a jump that no hand can make
  bool target_reachable{false};  ///< inside the workspace and the arm's reach
  bool watchdog_bit{false};      ///< a loop was found hung
};

struct ModeConfig {
  Duration hold_after{std::chrono::milliseconds(50)};
  Duration resume_within{std::chrono::milliseconds(200)};
  std::uint32_t resume_frames{5};
  Duration stop_after{std::chrono::seconds(1)};
  Duration unreachable_grace{std::chrono::milliseconds(200)};
};

struct ModeState {
  Mode mode{Mode::kOffline};
  Cause cause{Cause::kNone};
  std::uint32_t epoch{0};       ///< counts changes of mode
  TimePoint t{};                ///< of the tick that wrote this
  TimePoint t_since{};          ///< of the last change
  std::uint32_t holds{0};       ///< times that motion ended without the operator asking
  std::uint32_t request_id{0};  ///< newest request that was decided
  bool request_accepted{false};
  Cause refusal{Cause::kNone};  ///< why it was not
};

[[nodiscard]] constexpr bool is_moving_mode(Mode mode) noexcept {
  return mode == Mode::kEngaged || mode == Mode::kCoasting;
}

class ModeMachine {
 public:
  explicit ModeMachine(const ModeConfig& config) noexcept : config_(config) {}

  /// One tick. `request` may be null. The mode changes at most once per tick, except that a request is decided on the
  /// mode after the health checks of the same tick.
  const ModeState& step(TimePoint now, const Request* request, const Health& health) noexcept;
  [[nodiscard]] const ModeState& state() const noexcept { return state_; }

 private:
  void enter(Mode mode, Cause cause, TimePoint now) noexcept;
  void check_faults(TimePoint now, const Health& health) noexcept;
  void check_input(TimePoint now, const Health& health) noexcept;
  void check_readiness(TimePoint now, const Health& health) noexcept;
  [[nodiscard]] bool decide(TimePoint now, const Request& request, const Health& health) noexcept;
  bool refuse(Cause cause) noexcept;
  [[nodiscard]] bool shutting_down() const noexcept;
  [[nodiscard]] bool fresh(TimePoint now, const Health& health) const noexcept;
  /// First reason why engaging is not possible now, kNone if it is.
  [[nodiscard]] Cause obstacle(TimePoint now, const Health& health) const noexcept;

  ModeConfig config_;
  ModeState state_;
  TimePoint t_reachable_{};  ///< last tick with a reachable target
};

}  // namespace embody::safety
