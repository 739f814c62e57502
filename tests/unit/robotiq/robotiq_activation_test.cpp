// A gripper that is not activated, loses its activation, or has a fault: nothing moves until somebody says so.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/robotiq/rig.hpp"

namespace embody::test {
namespace {

sim::RobotiqSimulatorConfig fresh_gripper() {
  sim::RobotiqSimulatorConfig config;
  config.gripper.start_counts = 120.0;
  config.gripper.activation_s = 0.6;
  return config;
}

TEST(RobotiqActivation, AGripperThatIsNotActivatedIsNeverMoved) {
  RobotiqRig rig(patient_config(), fresh_gripper());
  EXPECT_NE(rig.info.peer.view().find("not activated"), std::string_view::npos) << rig.info.peer.view();
  EXPECT_NE(rig.hand->why_not().find("not activated"), std::string_view::npos) << rig.hand->why_not();
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(rig.hand->write(RobotiqRig::move(0.02 * i), transport::now()), IoStatus::kRefused);
    static_cast<void>(rig.turn());
    ASSERT_TRUE(rig.cycle(RobotiqRig::plain(i % 2 == 0 ? HandAction::kHold : HandAction::kStop)));
  }
  rig.hand.reset();
  EXPECT_EQ(rig.simulator.counters().activations, 0u);
  EXPECT_EQ(rig.simulator.counters().motions, 0u);
  EXPECT_EQ(rig.simulator.travelled_counts(), 0.0);
}

TEST(RobotiqActivation, ActivateOpensAndClosesAndThenMotionIsAccepted) {
  RobotiqRig rig(patient_config(), fresh_gripper());
  const Status done = rig.hand->activate();
  ASSERT_TRUE(done.ok()) << done.error().detail.view();
  EXPECT_EQ(rig.simulator.counters().activations, 1u);
  EXPECT_GT(rig.simulator.travelled_counts(), 400.0);
  EXPECT_TRUE(rig.hand->why_not().empty()) << rig.hand->why_not();
  EXPECT_TRUE(rig.move_until(0.5, [&rig] { return std::abs(rig.state.q_rad[0] - 0.5) < 0.003; }));
  ASSERT_TRUE(rig.hand->activate().ok());
  EXPECT_EQ(rig.simulator.counters().activations, 1u) << "an activated gripper is left alone";
}

TEST(RobotiqActivation, ARequestFromAnotherThreadIsTakenUpByTheLoopWhichRefusesMotionMeanwhile) {
  RobotiqRig rig(patient_config(), fresh_gripper());
  rig.hand->request_activation();
  ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  ASSERT_TRUE(rig.turn_until([&rig] { return rig.simulator.counters().activations == 1; }));
  EXPECT_TRUE(rig.hand->activating());
  EXPECT_EQ(rig.hand->write(RobotiqRig::move(0.5), transport::now()), IoStatus::kRefused);
  const TimePoint deadline = transport::now() + std::chrono::seconds(5);
  while (!rig.hand->why_not().empty() && transport::now() < deadline) {
    ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  }
  EXPECT_EQ(rig.hand->why_not(), "");
  EXPECT_EQ(rig.simulator.counters().motions, 0u);
}

TEST(RobotiqActivation, StopEndsAnActivationUnderWay) {
  sim::RobotiqSimulatorConfig simulated = fresh_gripper();
  simulated.gripper.activation_s = 3.0;
  RobotiqRig rig(patient_config(), simulated);
  rig.hand->request_activation();
  ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  ASSERT_TRUE(rig.turn_until([&rig] { return rig.simulator.travelled_counts() > 10.0; }));
  const std::uint64_t resets = rig.simulator.counters().resets;
  ASSERT_EQ(rig.hand->write(RobotiqRig::plain(HandAction::kStop), transport::now()), IoStatus::kDone);
  ASSERT_TRUE(rig.turn_until([&] { return rig.simulator.counters().resets > resets; }));
  const double travelled = rig.simulator.travelled_counts();
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  EXPECT_EQ(rig.simulator.travelled_counts(), travelled);
  EXPECT_FALSE(rig.hand->activating());
  EXPECT_NE(rig.hand->why_not().find("not activated"), std::string_view::npos);
}

TEST(RobotiqActivation, ARequestIsForgottenByAStopByANewSessionAndWithAge) {
  RobotiqRig rig(patient_config(), fresh_gripper());
  ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  rig.hand->request_activation();
  ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kStop)));
  ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  rig.hand->request_activation();
  const auto again = rig.hand->connect();
  ASSERT_TRUE(again.ok()) << again.error().detail.view();
  rig.info = *again;
  ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  rig.hand->request_activation();
  const TimePoint later = transport::now() + milliseconds(600);
  while (transport::now() < later) static_cast<void>(rig.turn());
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  EXPECT_EQ(rig.simulator.counters().activations, 0u);
  EXPECT_EQ(rig.simulator.travelled_counts(), 0.0);
}

TEST(RobotiqActivation, AGripperThatLosesItsPowerInTheMidstOfMotionIsNotActivatedAgain) {
  RobotiqRig rig;
  ASSERT_TRUE(rig.move_until(0.6, [&rig] { return rig.simulator.counts() > 100.0; }));
  const TimePoint start = transport::now();
  // As a real one: nothing is heard while it restarts.
  rig.inject("mute on");
  static_cast<void>(rig.hand->write(RobotiqRig::move(0.65), transport::now()));
  while (transport::now() < start + milliseconds(400)) static_cast<void>(rig.turn());
  rig.inject("deactivate");
  rig.inject("mute off");
  const double travelled = rig.simulator.travelled_counts();
  const std::uint64_t activations = rig.simulator.counters().activations;
  while (transport::now() < start + milliseconds(900)) {
    static_cast<void>(rig.hand->write(RobotiqRig::move(0.1), transport::now()));
    ASSERT_NE(rig.turn(), IoStatus::kDisconnected);
  }
  EXPECT_EQ(rig.simulator.counters().activations, activations);
  EXPECT_EQ(rig.simulator.travelled_counts(), travelled);
  EXPECT_NE(rig.hand->why_not().find("not activated"), std::string_view::npos) << rig.hand->why_not();
  rig.hand.reset();
  EXPECT_EQ(rig.simulator.counters().activations, activations) << "nor by the farewell";
  EXPECT_EQ(rig.simulator.travelled_counts(), travelled);
}

TEST(RobotiqActivation, FaultsRefuseMotionWithTheirTextAndEndAsTheManualSays) {
  RobotiqRig rig;
  ASSERT_TRUE(rig.move_until(0.3, [&rig] { return std::abs(rig.state.q_rad[0] - 0.3) < 0.003; }));
  for (const int code : {8, 10, 12, 14}) {
    rig.inject("fault " + std::to_string(code));
    const TimePoint start = transport::now();
    ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
    ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
    std::printf("  fault %d seen after %.0f ms\n", code, to_seconds(transport::now() - start) * 1e3);
    EXPECT_EQ(rig.hand->why_not(), robotiq::fault_text(static_cast<std::uint8_t>(code)));
    const std::uint64_t motions = rig.simulator.counters().motions;
    EXPECT_EQ(rig.hand->write(RobotiqRig::move(0.6), transport::now()), IoStatus::kRefused);
    EXPECT_EQ(rig.simulator.counters().motions, motions);
    if (code == 8) {
      rig.inject("fault 0");  // it cooled down
    } else {
      const Status done = rig.hand->activate();
      ASSERT_TRUE(done.ok()) << done.error().detail.view();
    }
    ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
    EXPECT_EQ(rig.hand->why_not(), "") << code;
  }
}

}  // namespace
}  // namespace embody::test
