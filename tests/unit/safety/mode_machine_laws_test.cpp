// Laws of the mode machine under a million ticks of random health and requests, in virtual time.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/unit/math/random_values.hpp"
#include "tests/unit/safety/mode_bench.hpp"

namespace embody::safety {
namespace {

using std::chrono::milliseconds;

/// Devices that fail now and then, a tracker that falls silent, an operator who asks for anything.
class RandomWorld {
 public:
  explicit RandomWorld(std::uint64_t seed) : random_(seed) { health.arm_at_rest = true; }

  void step() {
    const bool stall = chance(0.001);
    now += stall ? milliseconds(static_cast<int>(random_(20, 2500))) : milliseconds(static_cast<int>(random_(1, 9)));
    toggle(health.tracker_connected, 0.0005, 0.05);
    toggle(health.arm_connected, 0.0005, 0.05);
    toggle(health.hand_connected, 0.0005, 0.05);
    toggle(health.target_reachable, 0.002, 0.05);
    toggle(health.arm_following, 0.0005, 0.05);
    toggle(arm_ready_, 0.0005, 0.05);
    toggle(tracker_speaks_, 0.003, 0.03);
    toggle(health.arm_at_rest, 0.02, 0.05);
    health.watchdog_bit = chance(0.0001);
    health.hand_jumped = chance(0.0005);
    if (!arm_ready_ && health.arm == ArmCondition::kReady) {
      health.arm = static_cast<ArmCondition>(static_cast<int>(random_(0.0, 6.999)));
    }
    if (arm_ready_) health.arm = ArmCondition::kReady;
    if (tracker_speaks_ && chance(0.4)) {
      const bool gap = now - health.t_pose > milliseconds(50);
      health.t_pose = now - milliseconds(static_cast<int>(random_(0, 8)));
      health.fresh_streak = gap || chance(0.002) ? 1 : health.fresh_streak + 1;
    }
  }
  bool asks(Request& request) {
    if (!chance(0.05)) return false;
    const double kind = random_(0.0, 1.0);
    request.kind = kind < 0.6    ? RequestKind::kEngage
                   : kind < 0.7  ? RequestKind::kDisengage
                   : kind < 0.75 ? RequestKind::kStop
                                 : RequestKind::kReset;
    ++request.id;
    return true;
  }
  bool chance(double probability) { return random_(0.0, 1.0) < probability; }

  TimePoint now{std::chrono::seconds(1000)};
  Health health;

 private:
  void toggle(bool& good, double fails, double recovers) { good = good ? !chance(fails) : chance(recovers); }

  test::RandomValues random_;
  bool arm_ready_{true};
  bool tracker_speaks_{true};
};

struct Tally {
  long engaged{0}, coasting{0}, holding{0}, stopped{0}, resumed{0}, holds{0};
};

bool ends_motion(Mode before, Mode after) {
  return is_moving_mode(before) && (after == Mode::kHolding || after == Mode::kStopped);
}

bool must_stop(const Health& health) {
  const bool bad = health.arm == ArmCondition::kProtectiveStop || health.arm == ArmCondition::kEmergencyStop ||
                   health.arm == ArmCondition::kFault;
  return health.watchdog_bit || (health.arm_connected && bad);
}

/// One tick, checked against the laws. `licence`: an accepted engage since motion last ended.
void check_tick(ModeMachine& machine, const ModeConfig& config, RandomWorld& world, Request& request, bool& licence,
                Tally& tally) {
  const ModeState before = machine.state();
  const bool asked = world.asks(request);
  ModeMachine silent = machine;  // the same tick without the operator
  const ModeState alone = silent.step(world.now, nullptr, world.health);
  const ModeState after = machine.step(world.now, asked ? &request : nullptr, world.health);
  const auto accepted = [&](RequestKind kind) {
    return asked && request.kind == kind && after.request_id == request.id && after.request_accepted;
  };

  // Motion needs a licence.
  if (!is_moving_mode(alone.mode)) licence = false;
  if (accepted(RequestKind::kEngage)) licence = true;
  ASSERT_TRUE(!is_moving_mode(after.mode) || licence) << "moves without an engage request";
  if (!is_moving_mode(after.mode)) licence = false;
  if (before.mode == Mode::kStopped && after.mode != Mode::kStopped) {
    ASSERT_TRUE(accepted(RequestKind::kReset)) << "left stopped without a reset";
  }
  if (before.mode == Mode::kHolding && is_moving_mode(after.mode)) {
    ASSERT_TRUE(accepted(RequestKind::kEngage)) << "left holding without an engage request";
  }

  // Late input never moves the robot.
  if (after.mode == Mode::kEngaged) {
    ASSERT_LE(world.now - world.health.t_pose, config.hold_after);
  }
  if (after.mode == Mode::kCoasting) {
    ASSERT_LE(world.now - after.t_since, config.resume_within);
  }
  if (must_stop(world.health)) {
    ASSERT_EQ(after.mode, Mode::kStopped);
  }

  // Counts.
  ASSERT_EQ(alone.holds - before.holds, ends_motion(before.mode, alone.mode) ? 1U : 0U);
  ASSERT_EQ(after.holds, alone.holds) << "the operator's own requests are no holds";
  ASSERT_EQ(after.t, world.now);
  const bool first_tick = before.t == TimePoint{};
  ASSERT_TRUE(first_tick || (after.epoch == before.epoch) == (after.t_since == before.t_since));
  if (after.mode != before.mode) {
    ASSERT_NE(after.epoch, before.epoch);
  }

  tally.engaged += after.mode == Mode::kEngaged;
  tally.coasting += after.mode == Mode::kCoasting;
  tally.holding += after.mode == Mode::kHolding;
  tally.stopped += after.mode == Mode::kStopped;
  tally.resumed += before.mode == Mode::kCoasting && after.mode == Mode::kEngaged;
  tally.holds = after.holds;
}

TEST(ModeMachineLaws, HoldForAnySequenceOfHealthAndRequests) {
  const ModeConfig config;
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    RandomWorld world(seed);
    ModeMachine machine(config);
    Request request;
    bool licence = false;
    Tally tally;
    for (int i = 0; i < 250'000; ++i) {
      world.step();
      check_tick(machine, config, world, request, licence, tally);
      if (HasFatalFailure()) FAIL() << "seed " << seed << " tick " << i;
    }
    std::printf("seed %d: ticks engaged %ld, coasting %ld, holding %ld, stopped %ld; resumed %ld times, %ld holds\n",
                static_cast<int>(seed), tally.engaged, tally.coasting, tally.holding, tally.stopped, tally.resumed,
                tally.holds);
    // The world must have been eventful, or the laws say little.
    EXPECT_GT(tally.engaged, 10'000);
    EXPECT_GT(tally.resumed, 20);
    EXPECT_GT(tally.holds, 200);
  }
}

}  // namespace
}  // namespace embody::safety
