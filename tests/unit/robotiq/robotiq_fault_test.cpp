// Stopping, and what a gripper's driver does when the line or the gripper misbehaves.
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <cmath>

#include "tests/unit/robotiq/rig.hpp"

namespace embody::test {
namespace {

void report(const char* what, Duration span) {
  ::testing::Test::RecordProperty(what, std::to_string(to_seconds(span) * 1e3) + " ms");
  std::printf("  %s: %.0f ms\n", what, to_seconds(span) * 1e3);
}

/// Spins without talking to the gripper.
void wait(Duration span) {
  const TimePoint end = transport::now() + span;
  while (transport::now() < end) {
  }
}

TEST(RobotiqHand, StopStandsAndStaysUntilHoldAndMove) {
  RobotiqRig rig;
  ASSERT_TRUE(rig.move_until(0.7, [&rig] { return rig.simulator.counts() > 80.0; }));
  const TimePoint stopped = transport::now();
  ASSERT_EQ(rig.hand->write(RobotiqRig::plain(HandAction::kStop), stopped), IoStatus::kDone);
  EXPECT_TRUE(rig.hand->stopped());
  EXPECT_EQ(rig.hand->write(RobotiqRig::move(0.7), transport::now()), IoStatus::kRefused) << "latched at once";
  ASSERT_TRUE(rig.turn_until([&rig] { return rig.simulator.counters().stops == 1; }));
  report("stop reached the gripper after", transport::now() - stopped);
  const double counts = rig.simulator.counts();
  EXPECT_LT(counts, 250.0) << "stopped on the way";
  ASSERT_TRUE(rig.turn_until([&] { return transport::now() > stopped + milliseconds(200); }));
  EXPECT_EQ(rig.simulator.counts(), counts);
  EXPECT_EQ(rig.simulator.counters().resets, 0u) << "the gripper keeps its activation";

  EXPECT_EQ(rig.hand->write(RobotiqRig::move(0.7), transport::now()), IoStatus::kRefused) << "still latched";
  ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  EXPECT_TRUE(rig.hand->stopped()) << "holding alone opens nothing";
  ASSERT_TRUE(rig.move_until(0.7, [&rig] { return rig.simulator.counts() > 251.0; })) << "moves again";
  EXPECT_FALSE(rig.hand->stopped());
}

TEST(RobotiqHand, StopThatIsNotAnsweredIsRepeatedAndEndsInAReset) {
  RobotiqRig rig(quick_config());
  ASSERT_TRUE(rig.move_until(0.7, [&rig] { return rig.simulator.counts() > 60.0; }));
  rig.inject("mute on");
  const auto lost = rig.time_to_loss(HandAction::kStop);
  ASSERT_TRUE(lost);
  report("unanswered stop: session over after", *lost);
  EXPECT_GE(rig.simulator.counters().stops, 1u);
  EXPECT_GE(rig.simulator.counters().resets, 1u);
  EXPECT_EQ(rig.simulator.counters().activations, 0u);
}

TEST(RobotiqHand, TellsItsCurrentAndWhatStandsInTheWay) {
  {
    RobotiqRig rig(patient_config(), {});
    ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
    EXPECT_EQ(rig.state.telemetry.condition, HandCondition::kNotActivated);
    EXPECT_EQ(rig.state.telemetry.why_not.view(), rig.hand->why_not());
    EXPECT_FALSE(rig.state.telemetry.why_not.empty());
  }
  RobotiqRig rig;
  const HandTelemetry& telemetry = rig.state.telemetry;
  ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  EXPECT_EQ(telemetry.condition, HandCondition::kReady);
  EXPECT_EQ(telemetry.supply, HandSupply::kGood);
  EXPECT_TRUE(telemetry.current_in_ampere);
  EXPECT_EQ(telemetry.current_count, 1u);
  EXPECT_EQ(telemetry.current_a[0], rig.hand->status().current_a());
  EXPECT_EQ(telemetry.t_force, TimePoint{}) << "it has no force sensors";
  rig.inject("fault 10");
  ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  EXPECT_EQ(telemetry.condition, HandCondition::kFault);
  EXPECT_EQ(telemetry.supply, HandSupply::kLow);
  EXPECT_NE(telemetry.why_not.view().find("supply"), std::string_view::npos);
  EXPECT_EQ(rig.hand->counters().faults, 1u) << "one fault, however often it is told";
}

TEST(RobotiqHand, DroppedGarbledAndBrokenAnswersAreCountedAndSurvived) {
  for (const char* fault : {"drop 2", "garble 2", "crc 2"}) {
    RobotiqRig rig(quick_config());
    ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
    rig.inject(fault);
    const TimePoint start = transport::now();
    const std::uint64_t timeouts = rig.hand->counters().timeouts;
    const std::uint64_t replies = rig.replies;
    // Whatever the answers, the target arrives.
    const TimePoint deadline = start + std::chrono::seconds(5);
    while (rig.replies < replies + 3 && transport::now() < deadline) {
      static_cast<void>(rig.hand->write(RobotiqRig::move(0.4), transport::now()));
      ASSERT_NE(rig.turn(), IoStatus::kDisconnected) << fault;
    }
    report(fault, transport::now() - start);
    EXPECT_GE(rig.hand->counters().timeouts, timeouts + 2) << fault;
    const std::uint64_t damaged = fault == std::string_view("crc 2") ? 2 : 0;
    EXPECT_GE(rig.hand->counters().crc_errors, damaged) << fault;
    ASSERT_TRUE(rig.move_until(0.4, [&rig] { return std::abs(rig.state.q_rad[0] - 0.4) < 0.003; })) << fault;
  }
}

TEST(RobotiqHand, ExceptionsAreCountedAndManyOfThemEndTheSessionWithTheirName) {
  RobotiqRig rig;
  ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  rig.inject("exception 2");
  ASSERT_EQ(rig.hand->write(RobotiqRig::plain(HandAction::kHold), transport::now()), IoStatus::kDone);
  ASSERT_TRUE(rig.turn_until([&rig] { return rig.hand->counters().exceptions == 1; }));
  rig.inject("exception 1000");
  const auto lost = rig.time_to_loss(HandAction::kHold);
  ASSERT_TRUE(lost);
  report("refused requests: session over after", *lost);
  EXPECT_NE(rig.hand->reason().find("device failure"), std::string_view::npos) << rig.hand->reason();
  rig.inject("exception 0");
  EXPECT_TRUE(rig.hand->connect().ok());
}

TEST(RobotiqHand, SilenceEndsTheSessionAndConnectOpensANewOneWithoutMotion) {
  RobotiqRig rig;
  ASSERT_TRUE(rig.move_until(0.5, [&rig] { return std::abs(rig.state.q_rad[0] - 0.5) < 0.003; }));
  const double counts = rig.simulator.counts();
  const double travelled = rig.simulator.travelled_counts();
  rig.inject("mute on");
  const auto lost = rig.time_to_loss(HandAction::kHold);
  ASSERT_TRUE(lost);
  report("silence: session over after (reply time-out 150 ms)", *lost);
  EXPECT_FALSE(rig.hand->reason().empty());
  EXPECT_EQ(rig.turn(), IoStatus::kDisconnected) << "and stays so";
  rig.inject("mute off");
  const auto again = rig.hand->connect();
  ASSERT_TRUE(again.ok()) << again.error().detail.view();
  rig.info = *again;
  ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  EXPECT_EQ(rig.simulator.counts(), counts);
  EXPECT_EQ(rig.simulator.travelled_counts(), travelled);
  EXPECT_EQ(rig.simulator.counters().activations, 0u);
  EXPECT_TRUE(rig.move_until(0.1, [&rig] { return std::abs(rig.state.q_rad[0] - 0.1) < 0.003; })) << "goes on";
}

TEST(RobotiqHand, DefaultTimeoutsNoticeSilenceWithinHalfASecond) {
  RobotiqRig rig(robotiq::RobotiqConfig{});
  rig.inject("mute on");
  const auto lost = rig.time_to_loss(HandAction::kHold);
  ASSERT_TRUE(lost);
  report("silence: session over after (defaults)", *lost);
  EXPECT_LT(*lost, milliseconds(500));
}

TEST(RobotiqHand, UnpluggedCableEndsTheSessionAndPluggingInThroughTheLinkHelps) {
  sim::RobotiqSimulatorConfig simulated = activated_gripper();
  simulated.link = ::testing::TempDir() + "embody_robotiq_link_" + std::to_string(::getpid());
  RobotiqRig rig(patient_config(), simulated);
  ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  rig.inject("unplug");
  pollfd entry{rig.info.fd, POLLIN, 0};
  EXPECT_EQ(::poll(&entry, 1, 0), 1) << "the loop is woken at once";
  EXPECT_EQ(rig.hand->read(rig.state), IoStatus::kDisconnected);
  EXPECT_EQ(rig.hand->write(RobotiqRig::plain(HandAction::kStop), transport::now()), IoStatus::kDisconnected);
  const auto missing = rig.hand->connect();
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, Errc::kNotFound);
  rig.inject("plug");
  const auto again = rig.hand->connect();
  ASSERT_TRUE(again.ok()) << again.error().detail.view();
  EXPECT_EQ(rig.simulator.travelled_counts(), 0.0);
}

TEST(RobotiqHand, ADelayedAnswerIsNotTakenForTheAnswerToALaterWrite) {
  RobotiqRig rig(quick_config());
  ASSERT_TRUE(rig.cycle(RobotiqRig::plain(HandAction::kHold)));
  rig.inject("delay 30");  // longer than the driver waits
  static_cast<void>(rig.hand->write(RobotiqRig::plain(HandAction::kHold), transport::now()));
  ASSERT_TRUE(rig.turn_until([&rig] { return rig.hand->counters().timeouts >= 1; }));
  static_cast<void>(rig.hand->write(RobotiqRig::move(0.6), transport::now()));
  ASSERT_TRUE(rig.turn_until([&rig] { return rig.hand->counters().timeouts >= 2; }));
  rig.inject("delay 2");
  ASSERT_TRUE(rig.move_until(0.6, [&rig] { return std::abs(rig.state.q_rad[0] - 0.6) < 0.003; }));
}

TEST(RobotiqHand, DestructorStopsTheFingersAndKeepsTheActivation) {
  RobotiqRig rig;
  ASSERT_TRUE(rig.move_until(0.7, [&rig] { return rig.simulator.counts() > 70.0; }));
  rig.hand.reset();
  EXPECT_EQ(rig.simulator.counters().stops, 1u);
  const double counts = rig.simulator.counts();
  EXPECT_LT(counts, 240.0);
  wait(milliseconds(100));
  EXPECT_EQ(rig.simulator.counts(), counts);
  EXPECT_TRUE(rig.simulator.status().activated());
}

TEST(RobotiqHand, DestructorLooksFirstWhenItHasNotHeardFromTheGripperForAWhile) {
  RobotiqRig rig;
  wait(milliseconds(400));
  rig.hand.reset();
  EXPECT_EQ(rig.simulator.counters().stops, 1u);
  EXPECT_TRUE(rig.simulator.status().activated());
}

TEST(RobotiqHand, DestructorDoesNotHangOnASilentGripper) {
  RobotiqRig rig(quick_config());
  rig.inject("mute on");
  const TimePoint start = transport::now();
  rig.hand.reset();
  report("destructor on a silent gripper", transport::now() - start);
  EXPECT_LT(transport::now() - start, milliseconds(600));
  EXPECT_GE(rig.simulator.counters().resets, 1u);
}

}  // namespace
}  // namespace embody::test
