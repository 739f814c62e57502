#pragma once
// A mode machine in virtual time, and the health that keeps it in any wanted mode.
#include <optional>

#include "core/safety/mode_machine.hpp"

namespace embody::test {

using std::chrono::milliseconds;

/// Everything works at `now`: the machine would go to *aligned* and may engage.
inline safety::Health healthy(TimePoint now) {
  safety::Health health;
  health.tracker_connected = true;
  health.t_pose = now;
  health.fresh_streak = 100;
  health.arm_connected = true;
  health.arm = ArmCondition::kReady;
  health.hand_connected = true;
  health.target_reachable = true;
  return health;
}

class ModeBench {
 public:
  explicit ModeBench(const safety::ModeConfig& config = {}) : machine(config) {}

  /// `dt` later, a tick with `health` as it is, poses included.
  const safety::ModeState& tick(std::optional<safety::RequestKind> kind = {}, Duration dt = milliseconds(2)) {
    now += dt;
    const safety::Request request{kind.value_or(safety::RequestKind::kStop), ++last_id};
    return machine.step(now, kind ? &request : nullptr, health);
  }
  /// The same with a fresh pose.
  const safety::ModeState& fresh_tick(std::optional<safety::RequestKind> kind = {}, Duration dt = milliseconds(2)) {
    health.t_pose = now + dt;
    return tick(kind, dt);
  }

  /// Leads the machine into `mode`; health is then such that it stays there.
  void go_to(safety::Mode mode);

  safety::ModeMachine machine;
  TimePoint now{std::chrono::seconds(1000)};
  safety::Health health;
  std::uint32_t last_id{0};
};

inline void ModeBench::go_to(safety::Mode mode) {
  using safety::Mode;
  using safety::RequestKind;
  health = healthy(now);
  if (mode == Mode::kOffline) {
    health.tracker_connected = false;
    fresh_tick();
    return;
  }
  fresh_tick();
  if (mode == Mode::kIdle) {
    health.fresh_streak = 0;
    fresh_tick();
  }
  if (mode == Mode::kStopped) fresh_tick(RequestKind::kStop);
  if (mode != Mode::kEngaged && mode != Mode::kCoasting && mode != Mode::kHolding) return;
  fresh_tick(RequestKind::kEngage);
  if (mode == Mode::kEngaged) {
    health.arm_at_rest = false;
    return;
  }
  health.arm_at_rest = false;
  tick({}, milliseconds(60));  // coasting
  if (mode == Mode::kCoasting) return;
  health.arm_at_rest = true;
  tick();  // holding
  health.t_pose = now;
}

}  // namespace embody::test
