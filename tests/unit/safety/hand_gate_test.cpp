#include "core/safety/hand_gate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/heap_counter.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::safety {
namespace {

using std::chrono::milliseconds;
constexpr double kPeriod_s = 0.05;
constexpr std::size_t kJoints = 3;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// An engaged hand that has answered, with a fresh target, at one moment.
struct Moment {
  TimePoint now{std::chrono::seconds(100)};
  ModeState mode;
  FingerTarget target;
  HandDeviceState measured;

  Moment() {
    mode.mode = Mode::kEngaged;
    mode.t = now;
    target.valid = true;
    target.t_capture = now;
    target.joint_count = measured.joint_count = kJoints;
    measured.reply = 1;
    measured.t_arrival = now;
  }
  void advance(Duration d) {
    now += d;
    mode.t += d;
    target.t_capture += d;
    measured.t_arrival += d;
  }
  HandCommand step(HandGate& gate) const { return gate.step(now, kPeriod_s, mode, target, measured); }
  /// The next cycle of a hand that has gone where it was told to.
  HandCommand follow(HandGate& gate) {
    advance(milliseconds(50));
    const HandCommand command = step(gate);
    if (command.action == HandAction::kMove) measured.q_rad = command.q_rad;
    return command;
  }
};

TEST(HandGate, HoldsWhileAMeasuredAngleIsNoNumberAndGoesOnFromTheNextOnes) {
  for (const double nonsense : {kNan, std::numeric_limits<double>::infinity()}) {
    HandGate gate({});
    Moment moment;
    moment.target.q_rad.fill(1.0);
    for (int i = 0; i < 3; ++i) ASSERT_EQ(moment.follow(gate).action, HandAction::kMove);
    const auto q_rad = moment.measured.q_rad;
    moment.measured.q_rad[1] = nonsense;
    EXPECT_EQ(moment.follow(gate).action, HandAction::kHold);
    EXPECT_EQ(gate.hold(), HandHold::kNoAnswer);
    moment.measured.q_rad = q_rad;
    const HandCommand command = moment.follow(gate);
    ASSERT_EQ(command.action, HandAction::kMove);
    for (std::size_t i = 0; i < kJoints; ++i) {
      EXPECT_LE(std::abs(command.q_rad[i] - q_rad[i]), HandGateConfig{}.speed_rad_s * kPeriod_s + 1e-12);
    }
  }
}

TEST(HandGate, MovesNoJointFasterThanItsSpeedAndStartsFromTheMeasuredAngles) {
  const HandGateConfig config;
  for (const std::uint64_t seed : {1, 2, 3}) {
    test::RandomValues random(seed);
    HandGate gate(config);
    Moment moment;
    for (std::size_t i = 0; i < kJoints; ++i) moment.measured.q_rad[i] = random(0.0, 1.5);
    auto last = moment.measured.q_rad;
    for (int cycle = 0; cycle < 10'000; ++cycle) {
      for (std::size_t i = 0; i < kJoints; ++i) {
        if (random(0.0, 1.0) < 0.3) moment.target.q_rad[i] = random(0.0, 1.0) < 0.02 ? kNan : random(-1e3, 1e3);
      }
      const HandCommand command = moment.step(gate);
      ASSERT_EQ(command.action, HandAction::kMove);
      ASSERT_EQ(command.joint_count, kJoints);
      for (std::size_t i = 0; i < kJoints; ++i) {
        ASSERT_LE(std::abs(command.q_rad[i] - last[i]), config.speed_rad_s * kPeriod_s + 1e-9)
            << "seed " << seed << " cycle " << cycle << " joint " << i;
      }
      last = command.q_rad;
      moment.advance(milliseconds(50));
    }
  }
}

TEST(HandGate, ReachesATargetAndPassesOnWhenItWasCaptured) {
  HandGate gate({});
  Moment moment;
  moment.target.q_rad = {0.7, -0.2, 1.1};
  HandCommand command;
  for (int cycle = 0; cycle < 20; ++cycle) command = moment.follow(gate);
  for (std::size_t i = 0; i < kJoints; ++i) EXPECT_DOUBLE_EQ(command.q_rad[i], moment.target.q_rad[i]);
  EXPECT_EQ(command.t_capture, moment.target.t_capture);
}

TEST(HandGate, NeverLeadsTheMeasuredAnglesByMoreThanTheHandMayGoOnAfterItsLineIsCut) {
  const HandGateConfig config;
  for (const std::uint64_t seed : {1, 2, 3}) {
    test::RandomValues random(seed);
    HandGate gate(config);
    Moment moment;
    for (int cycle = 0; cycle < 10'000; ++cycle) {
      for (std::size_t i = 0; i < kJoints; ++i) {
        if (random(0.0, 1.0) < 0.1) moment.target.q_rad[i] = random(-1.5, 1.5);
        if (random(0.0, 1.0) < 0.1) moment.measured.q_rad[i] = random(-1.5, 1.5);  // blocked, free again, pushed
      }
      moment.advance(milliseconds(50));
      const HandCommand command = moment.step(gate);
      ASSERT_EQ(command.action, HandAction::kMove);
      for (std::size_t i = 0; i < kJoints; ++i) {
        ASSERT_LE(std::abs(command.q_rad[i] - moment.measured.q_rad[i]), config.lead_rad + 1e-12)
            << "seed " << seed << " cycle " << cycle << " joint " << i;
      }
    }
  }
}

TEST(HandGate, HoldsOnceBetweenAStopAndAMotionHoweverFastTheOperatorEngages) {
  HandGate gate({});
  Moment moment;
  moment.target.q_rad = {1.0, 1.0, 1.0};
  moment.mode.mode = Mode::kStopped;
  EXPECT_EQ(moment.step(gate).action, HandAction::kStop);
  moment.mode.mode = Mode::kEngaged;
  EXPECT_EQ(moment.step(gate).action, HandAction::kHold) << "a driver stays stopped until it is told to hold";
  EXPECT_EQ(moment.step(gate).action, HandAction::kMove);
}

TEST(HandGate, LeavesAJointAloneWhoseTargetIsNotANumber) {
  HandGate gate({});
  Moment moment;
  moment.measured.q_rad = {0.3, 0.4, 0.5};
  moment.target.q_rad = {1.0, kNan, -std::numeric_limits<double>::infinity()};
  const HandCommand command = moment.step(gate);
  EXPECT_EQ(command.action, HandAction::kMove);
  EXPECT_GT(command.q_rad[0], 0.3);
  EXPECT_EQ(command.q_rad[1], 0.4);
  EXPECT_EQ(command.q_rad[2], 0.5);
}

TEST(HandGate, MovesInModeEngagedOnlyAndStopsInModeStopped) {
  for (const Mode mode :
       {Mode::kOffline, Mode::kIdle, Mode::kAligned, Mode::kEngaged, Mode::kCoasting, Mode::kHolding, Mode::kStopped}) {
    HandGate gate({});
    Moment moment;
    moment.mode.mode = mode;
    const HandAction expected = mode == Mode::kEngaged   ? HandAction::kMove
                                : mode == Mode::kStopped ? HandAction::kStop
                                                         : HandAction::kHold;
    EXPECT_EQ(moment.step(gate).action, expected) << to_string(mode);
  }
}

TEST(HandGate, RefusesAModeThatIsTooOld) {
  for (const Mode mode : {Mode::kEngaged, Mode::kStopped}) {
    HandGate gate({});
    Moment moment;
    moment.mode.mode = mode;
    moment.mode.t = moment.now - milliseconds(100);
    EXPECT_NE(moment.step(gate).action, HandAction::kHold) << "exactly 100 ms old is still good";
    moment.mode.t -= Duration{1};
    EXPECT_EQ(moment.step(gate).action, HandAction::kHold) << "an old mode counts as holding";
  }
  HandGate gate({});
  Moment never;
  never.mode = {};
  EXPECT_EQ(never.step(gate).action, HandAction::kHold);
}

TEST(HandGate, DoesNotFollowATargetThatIsOldInvalidOrOfAnotherHand) {
  const auto action_after = [](auto&& change) {
    HandGate gate({});
    Moment moment;
    change(moment);
    return moment.step(gate).action;
  };
  EXPECT_EQ(action_after([](Moment& m) { m.target.t_capture -= milliseconds(500); }), HandAction::kMove);
  EXPECT_EQ(action_after([](Moment& m) { m.target.t_capture -= milliseconds(501); }), HandAction::kHold);
  EXPECT_EQ(action_after([](Moment& m) { m.target.valid = false; }), HandAction::kHold);
  EXPECT_EQ(action_after([](Moment& m) { m.target.joint_count = 2; }), HandAction::kHold);
  EXPECT_EQ(action_after([](Moment& m) { m.measured.reply = 0; }), HandAction::kHold);
  EXPECT_EQ(action_after([](Moment& m) { m.target = {}; }), HandAction::kHold);
}

TEST(HandGate, StartsAfreshFromTheMeasuredAnglesAfterEveryInterruption) {
  HandGate gate({});
  Moment moment;
  moment.target.q_rad = {1.0, 1.0, 1.0};
  for (int cycle = 0; cycle < 30; ++cycle) {
    moment.advance(milliseconds(50));
    (void)moment.step(gate);
  }
  moment.mode.mode = Mode::kCoasting;
  EXPECT_EQ(moment.step(gate).action, HandAction::kHold);
  moment.measured.q_rad = {0.2, 0.3, 0.4};  // pushed back meanwhile
  moment.mode.mode = Mode::kEngaged;
  const HandCommand command = moment.step(gate);
  const HandGateConfig config;
  for (std::size_t i = 0; i < kJoints; ++i) {
    EXPECT_NEAR(command.q_rad[i], moment.measured.q_rad[i] + config.speed_rad_s * kPeriod_s, 1e-12);
  }
}

HandGateConfig careful() {
  HandGateConfig config;
  config.min_confidence = 0.2;
  return config;
}

TEST(HandGate, AJointThatIsNotSureKeepsItsLastTargetWhileTheOthersGoOn) {
  for (const double unsure : {0.0, 0.199, kNan}) {
    HandGate gate(careful());
    Moment moment;
    moment.target.hand_confidence = 1.0;
    moment.target.joint_confidence.fill(1.0);
    moment.target.q_rad = {0.5, 0.5, 0.5};
    HandCommand command = moment.follow(gate);
    EXPECT_EQ(gate.kept_joints(), 0U);
    moment.target.joint_confidence[1] = unsure;
    moment.target.q_rad = {1.0, 1.0, 1.0};
    for (int cycle = 0; cycle < 40; ++cycle) {
      command = moment.follow(gate);
      ASSERT_EQ(command.action, HandAction::kMove);
      ASSERT_EQ(gate.kept_joints(), 2U) << "bit of joint 1";
    }
    EXPECT_DOUBLE_EQ(command.q_rad[0], 1.0);
    EXPECT_DOUBLE_EQ(command.q_rad[1], 0.5) << "confidence " << unsure;
    EXPECT_DOUBLE_EQ(command.q_rad[2], 1.0);
    moment.target.joint_confidence[1] = 0.2;
    for (int cycle = 0; cycle < 40; ++cycle) command = moment.follow(gate);
    EXPECT_DOUBLE_EQ(command.q_rad[1], 1.0) << "sure again, it catches up";
    EXPECT_EQ(gate.kept_joints(), 0U);
  }
}

TEST(HandGate, AJointThatWasNeverSureStaysWhereItIs) {
  HandGate gate(careful());
  Moment moment;
  moment.measured.q_rad = {0.3, 0.4, 0.5};
  moment.target.hand_confidence = 1.0;
  moment.target.q_rad = {1.0, 1.0, 1.0};
  for (int cycle = 0; cycle < 10; ++cycle) {
    moment.advance(milliseconds(50));
    const HandCommand command = moment.step(gate);
    for (std::size_t i = 0; i < kJoints; ++i) ASSERT_DOUBLE_EQ(command.q_rad[i], moment.measured.q_rad[i]);
  }
}

TEST(HandGate, HoldsTheWholeHandWhileItIsNotSureAndSaysWhy) {
  for (const double unsure : {0.0, 0.199, kNan}) {
    HandGate gate(careful());
    Moment moment;
    moment.target.joint_confidence.fill(1.0);
    moment.target.hand_confidence = unsure;
    EXPECT_EQ(moment.step(gate).action, HandAction::kHold);
    EXPECT_EQ(gate.hold(), HandHold::kUnsure);
    EXPECT_NE(std::string(to_string(gate.hold())).find("min_hand_confidence"), std::string::npos);
    moment.target.hand_confidence = 0.2;
    EXPECT_EQ(moment.step(gate).action, HandAction::kMove);
    EXPECT_EQ(gate.hold(), HandHold::kNone);
  }
}

TEST(HandGate, EachReasonToHoldHasItsName) {
  const auto reason_after = [](auto&& change) {
    HandGate gate({});
    Moment moment;
    change(moment);
    (void)moment.step(gate);
    return gate.hold();
  };
  EXPECT_EQ(reason_after([](Moment&) {}), HandHold::kNone);
  EXPECT_EQ(reason_after([](Moment& m) { m.mode.t -= milliseconds(101); }), HandHold::kModeStale);
  EXPECT_EQ(reason_after([](Moment& m) { m.mode.mode = Mode::kAligned; }), HandHold::kMode);
  EXPECT_EQ(reason_after([](Moment& m) { m.measured.reply = 0; }), HandHold::kNoAnswer);
  EXPECT_EQ(reason_after([](Moment& m) { m.measured.q_rad[2] = kNan; }), HandHold::kNoAnswer);
  EXPECT_EQ(reason_after([](Moment& m) { m.measured.t_arrival -= milliseconds(150); }), HandHold::kNone);
  EXPECT_EQ(reason_after([](Moment& m) { m.measured.t_arrival -= milliseconds(151); }), HandHold::kNoAnswer);
  EXPECT_EQ(reason_after([](Moment& m) { m.target.valid = false; }), HandHold::kNotSeen);
  EXPECT_EQ(reason_after([](Moment& m) { m.target.t_capture -= milliseconds(501); }), HandHold::kTargetStale);
}

TEST(HandGate, NeverCommandsAnAngleThatIsNotFinite) {
  HandGate gate({});
  Moment moment;
  moment.measured.q_rad = {kNan, 0.3, 0.4};
  moment.target.q_rad = {0.5, 0.5, 0.5};
  for (int cycle = 0; cycle < 3; ++cycle) {
    moment.advance(milliseconds(50));
    const HandCommand command = moment.step(gate);
    if (command.action != HandAction::kMove) continue;
    for (std::size_t i = 0; i < kJoints; ++i) EXPECT_TRUE(std::isfinite(command.q_rad[i])) << "joint " << i;
    moment.measured.q_rad[0] = 0.2;  // the next reply is good again
  }
}

TEST(HandGate, UsesNoHeap) {
  HandGate gate({});
  const Moment moment;
  const std::uint64_t before = test::heap_allocations();
  for (int i = 0; i < 100; ++i) (void)moment.step(gate);
  EXPECT_EQ(test::heap_allocations(), before);
}

}  // namespace
}  // namespace embody::safety
