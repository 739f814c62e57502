#include <gtest/gtest.h>

#include <array>
#include <set>
#include <string>

#include "tests/support/heap_counter.hpp"
#include "tests/unit/safety/mode_bench.hpp"

namespace embody::safety {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::ModeBench;

constexpr Mode O = Mode::kOffline, I = Mode::kIdle, A = Mode::kAligned, E = Mode::kEngaged, C = Mode::kCoasting,
               H = Mode::kHolding, S = Mode::kStopped;
constexpr std::array<Mode, 7> kModes{O, I, A, E, C, H, S};

TEST(ModeMachine, StaysInEachModeWhileNothingChanges) {
  for (const Mode mode : kModes) {
    ModeBench bench;
    bench.go_to(mode);
    ASSERT_EQ(bench.machine.state().mode, mode) << "the bench itself";
    EXPECT_EQ(bench.tick().mode, mode);
  }
}

struct Disturbance {
  const char* what;
  void (*apply)(ModeBench&);
  std::array<Mode, 7> expected;  // from offline, idle, aligned, engaged, coasting, holding, stopped
  Cause cause;                   // where the mode changes, unless it becomes offline
};

template <ArmCondition kCondition>
void arm_becomes(ModeBench& bench) {
  bench.health.arm = kCondition;
}

// What one tick makes of a health that changed (docs: section "Modes").
const Disturbance kDisturbances[] = {
    {"the hand is lost",
     [](ModeBench& b) { b.health.hand_connected = false; },
     {O, O, O, S, S, S, S},
     Cause::kHandLost},
    {"the tracker is lost", [](ModeBench& b) { b.health.tracker_connected = false; }, {O, O, O, E, C, H, S}, {}},
    {"the arm is lost", [](ModeBench& b) { b.health.arm_connected = false; }, {O, O, O, S, S, S, S}, Cause::kArmLost},
    {"the arm is switched off", arm_becomes<ArmCondition::kNotRunning>, {O, I, I, S, S, S, S}, Cause::kArmNotReady},
    {"the arm's condition is unknown", arm_becomes<ArmCondition::kUnknown>, {O, I, I, S, S, S, S}, Cause::kArmNotReady},
    {"the program on the robot ends",
     arm_becomes<ArmCondition::kProgramStopped>,
     {O, I, I, S, S, S, S},
     Cause::kArmProgramStopped},
    {"protective stop", arm_becomes<ArmCondition::kProtectiveStop>, {S, S, S, S, S, S, S}, Cause::kProtectiveStop},
    {"emergency stop", arm_becomes<ArmCondition::kEmergencyStop>, {S, S, S, S, S, S, S}, Cause::kEmergencyStop},
    {"safety fault", arm_becomes<ArmCondition::kFault>, {S, S, S, S, S, S, S}, Cause::kArmFault},
    {"a loop hangs", [](ModeBench& b) { b.health.watchdog_bit = true; }, {S, S, S, S, S, S, S}, Cause::kWatchdog},
    {"the robot does not follow",
     [](ModeBench& b) { b.health.arm_following = false; },
     {O, I, A, H, H, H, S},
     Cause::kArmNotFollowing},
    {"the hand pose jumps",
     [](ModeBench& b) { b.health.hand_jumped = true; },
     {O, I, A, H, H, H, S},
     Cause::kHandPoseJumped},
    {"the pose is 60 ms old",
     [](ModeBench& b) { b.health.t_pose = b.now - milliseconds(60); },
     {O, I, I, C, C, H, S},
     Cause::kTrackerStale},
    {"the pose is 1.1 s old",
     [](ModeBench& b) { b.health.t_pose = b.now - milliseconds(1100); },
     {O, I, I, C, C, S, S},
     Cause{}},
    {"poses are not plausible", [](ModeBench& b) { b.health.fresh_streak = 4; }, {O, I, I, E, C, H, S}, {}},
    {"the target is out of reach",
     [](ModeBench& b) { b.health.target_reachable = false; },
     {O, I, I, E, C, H, S},
     Cause::kTargetUnreachable},
    {"the set-point moves", [](ModeBench& b) { b.health.arm_at_rest = false; }, {O, I, I, E, C, H, S}, {}},
};

TEST(ModeMachine, AnswersEveryDisturbanceInEveryModeAsDocumented) {
  for (const Disturbance& disturbance : kDisturbances) {
    for (std::size_t i = 0; i < kModes.size(); ++i) {
      SCOPED_TRACE(std::string(disturbance.what) + " in mode " + to_string(kModes[i]));
      ModeBench bench;
      bench.go_to(kModes[i]);
      disturbance.apply(bench);
      const ModeState& state = bench.tick();
      EXPECT_STREQ(to_string(state.mode), to_string(disturbance.expected[i]));
      const bool changed = state.mode != kModes[i] && state.mode != O;
      if (changed && disturbance.cause != Cause::kNone) {
        EXPECT_STREQ(to_string(state.cause), to_string(disturbance.cause));
      }
    }
  }
}

struct Answer {
  bool accepted;
  Mode mode;
};

TEST(ModeMachine, AnswersEveryRequestInEveryModeAsDocumented) {
  const struct {
    RequestKind kind;
    const char* what;
    std::array<Answer, 7> answers;
  } kRequests[] = {
      {RequestKind::kEngage,
       "engage",
       {{{false, O}, {false, I}, {true, E}, {true, E}, {false, C}, {true, E}, {false, S}}}},
      {RequestKind::kDisengage,
       "disengage",
       {{{true, O}, {true, I}, {true, A}, {true, I}, {true, I}, {true, I}, {false, S}}}},
      {RequestKind::kStop, "stop", {{{true, S}, {true, S}, {true, S}, {true, S}, {true, S}, {true, S}, {true, S}}}},
      {RequestKind::kReset, "reset", {{{true, O}, {true, I}, {true, A}, {true, E}, {true, C}, {true, H}, {true, I}}}},
      {RequestKind::kShutdown,
       "shutdown",
       {{{true, S}, {true, S}, {true, S}, {true, S}, {true, S}, {true, S}, {true, S}}}},
  };
  for (const auto& request : kRequests) {
    for (std::size_t i = 0; i < kModes.size(); ++i) {
      SCOPED_TRACE(std::string(request.what) + " in mode " + to_string(kModes[i]));
      ModeBench bench;
      bench.go_to(kModes[i]);
      const std::uint32_t holds = bench.machine.state().holds;
      const ModeState& state = bench.tick(request.kind);
      EXPECT_EQ(state.request_id, bench.last_id);
      EXPECT_EQ(state.request_accepted, request.answers[i].accepted);
      EXPECT_STREQ(to_string(state.mode), to_string(request.answers[i].mode));
      EXPECT_EQ(state.holds, holds) << "what the operator asks for is no involuntary end of motion";
    }
  }
}

TEST(ModeMachine, RefusesToEngageWhileAnythingIsMissing) {
  void (*const kObstacles[])(Health&) = {
      [](Health& h) { h.tracker_connected = false; }, [](Health& h) { h.arm = ArmCondition::kNotRunning; },
      [](Health& h) { h.fresh_streak = 4; },          [](Health& h) { h.t_pose -= milliseconds(51); },
      [](Health& h) { h.target_reachable = false; },  [](Health& h) { h.arm_at_rest = false; },
  };
  for (const Mode start : {A, H}) {
    for (const auto& obstruct : kObstacles) {
      ModeBench bench;
      bench.go_to(start);
      bench.health.t_pose = bench.now + milliseconds(2);
      obstruct(bench.health);
      const ModeState& state = bench.tick(RequestKind::kEngage);
      EXPECT_FALSE(state.request_accepted);
      EXPECT_NE(state.mode, E);
    }
  }
}

TEST(ModeMachine, GoesOnWhenInputReturnsAtOnceAndTheArmStillMoves) {
  for (const std::uint32_t streak : {0U, 4U, 5U}) {
    ModeBench bench;
    bench.go_to(C);
    bench.health.fresh_streak = streak;
    EXPECT_EQ(bench.fresh_tick().mode, streak >= 5 ? E : C) << streak << " good frames";
    EXPECT_EQ(bench.machine.state().holds, 0U);
  }
}

TEST(ModeMachine, HoldsWhenTheArmHasComeToRestBeforeTheInputReturned) {
  ModeBench bench;
  bench.go_to(C);
  bench.health.arm_at_rest = true;
  EXPECT_EQ(bench.fresh_tick().mode, H) << "good input does not help any more";
  EXPECT_EQ(bench.machine.state().holds, 1U);
  for (int i = 0; i < 5000; ++i) ASSERT_EQ(bench.fresh_tick().mode, H) << "left holding by itself";
}

TEST(ModeMachine, CoastsForTwoHundredMillisecondsAtMost) {
  ModeBench bench;
  bench.go_to(C);
  const TimePoint t_since = bench.machine.state().t_since;
  while (bench.tick({}, milliseconds(5)).mode == C) ASSERT_LE(bench.now - t_since, milliseconds(200));
  EXPECT_EQ(bench.machine.state().mode, H);
  EXPECT_EQ(bench.now - t_since, milliseconds(205));
}

TEST(ModeMachine, ToleratesAnUnreachableTargetForTheGraceOnly) {
  ModeBench bench;
  bench.go_to(E);
  bench.health.target_reachable = false;
  const TimePoint start = bench.now;
  while (bench.fresh_tick().mode == E) ASSERT_LE(bench.now - start, milliseconds(200));
  EXPECT_EQ(bench.machine.state().mode, H);
  EXPECT_EQ(bench.machine.state().cause, Cause::kTargetUnreachable);
  EXPECT_EQ(bench.now - start, milliseconds(202));

  ModeBench returning;
  returning.go_to(E);
  for (int i = 0; i < 1000; ++i) {  // away for 180 ms of each 200
    returning.health.target_reachable = i % 100 >= 90;
    ASSERT_EQ(returning.fresh_tick().mode, E);
  }
}

TEST(ModeMachine, StopsForGoodWhenInputStaysAwayForASecond) {
  ModeBench bench;
  bench.go_to(E);
  const TimePoint t_lost = bench.health.t_pose;
  std::set<Mode> seen;
  for (int i = 0; i < 1000; ++i) seen.insert(bench.tick().mode);
  EXPECT_EQ(bench.machine.state().mode, S);
  EXPECT_EQ(bench.machine.state().cause, Cause::kTrackerLost);
  EXPECT_EQ(bench.machine.state().holds, 1U) << "one end of motion, whatever followed";
  EXPECT_GT(bench.machine.state().t_since - t_lost, seconds(1));
  EXPECT_LE(bench.machine.state().t_since - t_lost, milliseconds(1002));
  EXPECT_EQ(seen, (std::set<Mode>{E, C, H, S}));
}

TEST(ModeMachine, IsLeftStoppedByAResetAloneAndThenNeedsANewEngage) {
  ModeBench bench;
  bench.go_to(E);
  bench.health.arm = ArmCondition::kProtectiveStop;
  bench.fresh_tick();
  EXPECT_FALSE(bench.fresh_tick(RequestKind::kReset).request_accepted) << "the robot is still in its stop";
  bench.health = test::healthy(bench.now);
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(bench.fresh_tick().mode, S);
  EXPECT_FALSE(bench.fresh_tick(RequestKind::kEngage).request_accepted);
  EXPECT_FALSE(bench.fresh_tick(RequestKind::kDisengage).request_accepted);
  EXPECT_EQ(bench.fresh_tick(RequestKind::kReset).mode, I);
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(bench.fresh_tick().mode, A);
  EXPECT_EQ(bench.fresh_tick(RequestKind::kEngage).mode, E);
}

TEST(ModeMachine, ResetsNeitherAHungLoopNorAShutdown) {
  ModeBench hung;
  hung.go_to(E);
  hung.health.watchdog_bit = true;
  hung.fresh_tick();
  EXPECT_FALSE(hung.fresh_tick(RequestKind::kReset).request_accepted);
  ModeBench down;
  down.go_to(E);
  down.fresh_tick(RequestKind::kShutdown);
  EXPECT_FALSE(down.fresh_tick(RequestKind::kReset).request_accepted);
  EXPECT_EQ(down.machine.state().mode, S);
}

TEST(ModeMachine, AShutdownStaysAShutdownWhenTheOperatorAlsoStops) {
  ModeBench bench;
  bench.go_to(E);
  bench.fresh_tick(RequestKind::kShutdown);
  bench.fresh_tick(RequestKind::kStop);
  EXPECT_FALSE(bench.fresh_tick(RequestKind::kReset).request_accepted);
  EXPECT_EQ(bench.machine.state().mode, S);
}

TEST(ModeMachine, ChangesTheModeOnceInATickWhenTwoThingsGoWrongTogether) {
  ModeBench bench;
  bench.go_to(E);
  const std::uint32_t epoch = bench.machine.state().epoch;
  bench.health.arm_following = false;
  bench.health.t_pose = bench.now - milliseconds(1100);
  bench.tick();
  EXPECT_EQ(bench.machine.state().epoch, epoch + 1);
}

TEST(ModeMachine, DisengagesIntoIdleAndBecomesAlignedWhenTheArmHasComeToRest) {
  ModeBench bench;
  bench.go_to(E);
  EXPECT_EQ(bench.fresh_tick(RequestKind::kDisengage).mode, I);
  for (int i = 0; i < 100; ++i) ASSERT_EQ(bench.fresh_tick().mode, I) << "the arm still brakes";
  bench.health.arm_at_rest = true;
  EXPECT_EQ(bench.fresh_tick().mode, A);
  EXPECT_EQ(bench.machine.state().holds, 0U);
}

TEST(ModeMachine, TellsWhenAndHowOftenTheModeChanged) {
  ModeBench bench;
  EXPECT_EQ(bench.machine.state().epoch, 0U);
  bench.go_to(A);
  const ModeState before = bench.machine.state();
  const ModeState& state = bench.fresh_tick(RequestKind::kEngage);
  EXPECT_EQ(state.epoch, before.epoch + 1);
  EXPECT_EQ(state.t_since, bench.now);
  EXPECT_EQ(state.t, bench.now);
  bench.fresh_tick();
  EXPECT_EQ(state.epoch, before.epoch + 1);
  EXPECT_EQ(state.t, bench.now);
  EXPECT_LT(state.t_since, bench.now);
}

TEST(ModeMachine, NamesEveryModeAndCauseDifferently) {
  std::set<std::string> names;
  for (const Mode mode : kModes) names.insert(to_string(mode));
  EXPECT_EQ(names.size(), kModes.size());
  std::set<std::string> phrases;
  for (int i = 0; i <= static_cast<int>(Cause::kShutdown); ++i) phrases.insert(to_string(static_cast<Cause>(i)));
  EXPECT_EQ(phrases.size(), static_cast<std::size_t>(Cause::kShutdown) + 1);
}

TEST(ModeMachine, UsesNoHeap) {
  ModeBench bench;
  bench.go_to(E);
  const std::uint64_t before = test::heap_allocations();
  for (int i = 0; i < 1000; ++i) bench.tick();
  EXPECT_EQ(test::heap_allocations(), before);
}

}  // namespace
}  // namespace embody::safety
