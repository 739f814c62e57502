// Profile "compact": the driver as the hand loop sees it.
#include <cmath>
#include <limits>

#include "tests/support/heap_counter.hpp"
#include "tests/unit/can/compact_rig.hpp"

namespace embody::test {
namespace {

TEST(MiaCanHand, NothingMovesOnConnectAndThePeerIsCalledWhatItIs) {
  sim::CompactHandConfig simulated;
  simulated.start_counts = {100.0, -120.0, 60.0};
  CompactRig rig(patient_compact(), simulated);
  EXPECT_EQ(rig.info.joint_count, mia::kMotors);
  EXPECT_EQ(rig.info.joint_names[1].view(), "j_index_fle");
  EXPECT_NE(
      rig.info.peer.view().find("user-defined CAN profile, not a Prensilia specification, unverified on hardware"),
      std::string_view::npos)
      << rig.info.peer.view();
  ASSERT_TRUE(rig.loop->until([&] { return rig.loop->replies >= 3; }));
  EXPECT_EQ(rig.simulator->counters().motions, 0u);
  EXPECT_EQ(rig.simulator->motor_counts(), simulated.start_counts);
  const auto q_rad = mia::joint_angles_rad({}, simulated.start_counts);
  for (std::size_t i = 0; i < mia::kMotors; ++i) EXPECT_NEAR(rig.loop->state.q_rad[i], q_rad[i], 1e-12);
  EXPECT_LE(rig.loop->state.t_arrival, transport::now());
}

TEST(MiaCanHand, ReachesItsTargetsAndReportsThem) {
  CompactRig rig;
  auto counts = mia::motor_counts({}, {0.5, -0.6, 0.7});
  ASSERT_TRUE(rig.drive([] { return move(0.5, -0.6, 0.7); }, [&] { return rig.at(counts); }));
  const std::uint64_t replies = rig.loop->replies;
  ASSERT_TRUE(rig.loop->until([&] { return rig.loop->replies >= replies + 2; }));
  EXPECT_NEAR(rig.loop->state.q_rad[1], -0.6, 0.02);
  const auto counters = rig.hand->counters();
  EXPECT_EQ(counters.damaged + counters.refusals + counters.stray_acks, 0u);
  EXPECT_EQ(rig.hand->forces().raw[0], 260) << "the forces frame came too";
  EXPECT_GT(rig.hand->currents()[0], 0);
}

TEST(MiaCanHand, SendsOnlyWhatChangedAndRefreshesOnceASecond) {
  CompactRig rig;
  const auto motions = [&] { return rig.simulator->counters().motions; };
  const TimePoint start = transport::now();
  ASSERT_TRUE(rig.drive([] { return move(0.2, 0.2, 0.2); }, [&] { return rig.hand->counters().acks >= 3; }));
  EXPECT_EQ(motions(), 3u);
  ASSERT_TRUE(rig.drive([] { return move(0.2, 0.2, 0.5); }, [&] { return rig.hand->counters().acks >= 4; }));
  EXPECT_EQ(motions(), 4u) << "one motor changed";
  ASSERT_TRUE(rig.drive([] { return move(0.2, 0.2, 0.5); }, [&] { return motions() >= 7; }));
  EXPECT_GT(transport::now() - start, milliseconds(800));
}

TEST(MiaCanHand, RefusesWhatHasExpiredOrIsNotFiniteOrHasTheWrongSize) {
  CompactRig rig;
  const std::uint64_t before = rig.hand->counters().commands;
  const TimePoint now = transport::now();
  HandCommand expired = move(0.5, 0.5, 0.5), never_valid = expired, wrong_size = expired;
  expired.t_expires = now - milliseconds(1);
  never_valid.t_expires = {};
  wrong_size.joint_count = 2;
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const HandCommand& command : {expired, never_valid, wrong_size, move(0.5, nan, 0.5), move(infinity, 0.5, 0.5)}) {
    EXPECT_EQ(rig.hand->write(command, now), IoStatus::kRefused);
  }
  EXPECT_EQ(rig.hand->counters().commands, before) << "nothing was sent";
}

TEST(MiaCanHand, TargetsBeyondTheLimitsEndAtTheLimits) {
  CompactRig rig;
  EXPECT_TRUE(rig.drive([] { return move(9.0, 9.0, 9.0); },
                        [&] {
                          return rig.at({255.0, std::round(mia::index_counts({}, 1.4)), 255.0});
                        }));
  EXPECT_TRUE(
      rig.drive([] { return move(-9.0, -9.0, -9.0); },
                [&] {
                  return rig.at({0.0, std::round(mia::index_counts({}, -1.4)), 0.0}) || rig.at({0.0, -255.0, 0.0});
                }));
}

TEST(MiaCanHand, StopLatchesAndOnlyAMotionAfterAHoldOpensIt) {
  CompactRig rig;
  ASSERT_TRUE(rig.drive([] { return move(1.0, 1.0, 1.2); }, [&] { return rig.simulator->motor_counts()[2] > 20.0; }));
  ASSERT_EQ(rig.hand->write(plain(HandAction::kStop), transport::now()), IoStatus::kDone);
  EXPECT_TRUE(rig.hand->stopped());
  EXPECT_EQ(rig.hand->write(move(1.0, 1.0, 1.2), transport::now()), IoStatus::kRefused) << "at once";
  ASSERT_TRUE(rig.loop->until([&] { return rig.simulator->counters().stops > 0; }));
  const auto still = rig.simulator->motor_counts();
  EXPECT_LT(still[2], 250.0) << "stopped on the way";
  const std::uint64_t motions = rig.simulator->counters().motions;
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(rig.hand->write(move(1.0, 1.0, 1.2), transport::now()), IoStatus::kRefused) << "no hold yet";
    rig.loop->turn();
  }
  EXPECT_EQ(rig.simulator->motor_counts(), still);
  ASSERT_TRUE(rig.drive([] { return plain(HandAction::kHold); },
                        [&] { return rig.hand->write(move(1.0, 1.0, 1.2), transport::now()) == IoStatus::kDone; }));
  EXPECT_FALSE(rig.hand->stopped());
  EXPECT_TRUE(rig.loop->until([&] { return rig.simulator->counters().motions > motions; }));
}

TEST(MiaCanHand, AStopIsTriedAgainAndThenToEachMotor) {
  auto config = patient_compact();
  config.ack_timeout = milliseconds(15);
  config.lost_after_timeouts = 100;
  CompactRig rig(config);
  rig.fault("drop_ack 6");  // four to all, two to single motors
  ASSERT_EQ(rig.hand->write(plain(HandAction::kStop), transport::now()), IoStatus::kDone);
  ASSERT_TRUE(rig.loop->until([&] { return rig.simulator->counters().stops >= 7; })) << rig.hand->reason();
  EXPECT_EQ(rig.hand->counters().stops, 1u);
  ASSERT_TRUE(rig.loop->until([&] { return rig.hand->counters().timeouts >= 6; }));
  static_cast<void>(rig.hand->write(plain(HandAction::kStop), transport::now()));
  EXPECT_TRUE(rig.loop->until([&] { return rig.simulator->counters().stops >= 8; })) << "never fully acknowledged";
  EXPECT_EQ(rig.hand->counters().stops, 2u);
}

TEST(MiaCanHand, TheDestructorStopsTheHandOnItsWay) {
  CompactRig rig;
  ASSERT_TRUE(rig.drive([] { return move(1.0, 1.0, 1.2); }, [&] { return rig.simulator->motor_counts()[2] > 20.0; }));
  rig.loop.reset();
  rig.hand.reset();
  EXPECT_GE(rig.simulator->counters().stops, 1u);
  const auto still = rig.simulator->motor_counts();
  EXPECT_LT(still[2], 250.0);
  EXPECT_EQ(rig.simulator->motor_counts(), still);
}

TEST(MiaCanHand, HeartbeatsComeWithTheTurnsOfTheLoop) {
  CompactRig rig;
  const TimePoint start = transport::now();
  const std::uint64_t before = rig.simulator->compact_counters().heartbeats;
  ASSERT_FALSE(rig.loop->until([] { return false; }, milliseconds(1050)));
  const double periods = to_seconds(transport::now() - start) / 0.1;
  const auto beats = static_cast<double>(rig.simulator->compact_counters().heartbeats - before);
  EXPECT_GE(beats, 0.6 * periods);
  EXPECT_LE(beats, periods + 2.0);
  EXPECT_EQ(rig.simulator->compact_counters().heartbeat_stops, 0u);
}

TEST(MiaCanHand, ExtendedIdentifiersAndAnotherBaseWorkTheSame) {
  auto config = patient_compact();
  config.ids.base = {0x18DA0000, true};
  sim::CompactHandConfig simulated;
  simulated.ids = config.ids;
  CompactRig rig(config, simulated);
  const auto counts = mia::motor_counts({}, {0.3, 0.3, 0.3});
  EXPECT_TRUE(rig.drive([] { return move(0.3, 0.3, 0.3); }, [&] { return rig.at(counts); }));
}

TEST(MiaCanHand, ReadAndWriteDoNotAllocate) {
  if (!counts_heap()) GTEST_SKIP() << "a sanitizer owns malloc";
  CompactRig rig;
  const std::uint64_t before = heap_allocations();
  for (int i = 0; i < 40; ++i) {
    const double q = 0.2 + 0.01 * i;
    static_cast<void>(rig.hand->write(move(q, q, q), transport::now()));
    static_cast<void>(rig.loop->turn());
  }
  static_cast<void>(rig.hand->write(plain(HandAction::kStop), transport::now()));
  for (int i = 0; i < 10; ++i) static_cast<void>(rig.loop->turn());
  EXPECT_EQ(heap_allocations(), before);
}

TEST(MiaCanHand, SaysWhatIsWrongWithItsConfiguration) {
  using Change = void (*)(mia::compact::CompactConfig&);
  for (const Change change : std::initializer_list<Change>{
           [](auto& c) {
             c.ids.base = {0x7F0, false};
           },
           [](auto& c) { c.speed_percent = 0; }, [](auto& c) { c.current_percent = 81; },
           [](auto& c) { c.state_rate_hz = 5; }, [](auto& c) { c.command_rate_hz = std::nan(""); },
           [](auto& c) { c.forces_every = -1; }, [](auto& c) { c.ack_timeout = Duration{0}; },
           [](auto& c) { c.heartbeat_period = Duration{0}; }, [](auto& c) { c.lost_after_timeouts = 0; },
           [](auto& c) { c.min_rad[1] = 2.0; }, [](auto& c) { c.transmission.thumb.rad_per_count = 0.0; }}) {
    mia::compact::CompactConfig config;
    config.interface = "unix:/nowhere/at/all";
    change(config);
    mia::compact::MiaCanHand hand(config);
    const auto connected = hand.connect();
    ASSERT_FALSE(connected.ok());
    EXPECT_EQ(connected.error().code, Errc::kInvalidArgument) << connected.error().detail.view();
  }
}

}  // namespace
}  // namespace embody::test
