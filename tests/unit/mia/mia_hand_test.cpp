#include "drivers/mia/mia_hand.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "drivers/transport/pty.hpp"
#include "drivers/transport/tty.hpp"
#include "tests/support/heap_counter.hpp"
#include "tests/unit/mia/rig.hpp"

namespace embody::test {
namespace {

constexpr double kPi = 3.14159265358979323846;

TEST(MiaHand, NothingMovesOnConnect) {
  sim::MiaSimulatorConfig simulated;
  simulated.start_counts = {100.0, -120.0, 60.0};
  MiaRig rig(patient_config(), simulated);
  EXPECT_EQ(rig.info.joint_count, 3u);
  EXPECT_EQ(rig.info.joint_names[1].view(), "j_index_fle");
  EXPECT_EQ(rig.info.rate_hz, 20.0);
  EXPECT_NE(rig.info.peer.view().find("FSIM00001"), std::string_view::npos) << rig.info.peer.view();
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  EXPECT_EQ(rig.simulator.counters().motions, 0u);
  EXPECT_EQ(rig.simulator.counters().stops, 0u);
  EXPECT_EQ(rig.simulator.motor_counts(), simulated.start_counts);
  const auto q_rad = mia::joint_angles_rad({}, simulated.start_counts);
  for (std::size_t i = 0; i < mia::kMotors; ++i) EXPECT_NEAR(rig.state.q_rad[i], q_rad[i], 1e-12);
  EXPECT_LT(rig.state.q_rad[1], -0.4) << "the lateral branch";
}

TEST(MiaHand, FollowsASineWithinTheLagOfThePlant) {
  MiaRig rig;
  const TimePoint start = transport::now();
  const auto target = [start](TimePoint t, std::size_t joint) {
    const double phase = 2.0 * kPi * 0.5 * to_seconds(t - start);
    return (joint == 0 ? 0.4 : 0.7) - (joint == 0 ? 0.3 : 0.5) * std::cos(phase);
  };
  for (int cycle = 0; cycle < 44; ++cycle) {
    const TimePoint next = start + milliseconds(50) * (cycle + 1);
    const TimePoint now = transport::now();
    ASSERT_EQ(rig.hand->write(MiaRig::move(target(now, 0), target(now, 1), target(now, 2)), now), IoStatus::kDone);
    while (transport::now() < next) ASSERT_NE(rig.turn(), IoStatus::kDisconnected);
  }
  EXPECT_GE(rig.replies, 35u);
  const auto log = rig.simulator.log();
  for (std::size_t joint = 0; joint < mia::kMotors; ++joint) {
    // Hold of a 20 Hz command (25 ms on average) plus the motor's 40 ms plus the bus.
    double best_rms = 1.0;
    Duration best_delay{0};
    for (Duration delay{0}; delay <= milliseconds(300); delay += milliseconds(5)) {
      double sum = 0.0;
      int count = 0;
      for (const sim::MiaSample& sample : log) {
        if (sample.t < start + milliseconds(500) || sample.t > start + milliseconds(2100)) continue;
        const double error = sample.q_rad[joint] - target(sample.t - delay, joint);
        sum += error * error;
        ++count;
      }
      ASSERT_GT(count, 100);
      const double rms = std::sqrt(sum / count);
      if (rms < best_rms) {
        best_rms = rms;
        best_delay = delay;
      }
    }
    RecordProperty(std::string("lag_ms_") + std::to_string(joint), static_cast<int>(best_delay.count() / 1'000'000));
    EXPECT_LT(best_rms, 0.03) << mia::kJointNames[joint];
    EXPECT_GE(best_delay, milliseconds(30)) << mia::kJointNames[joint];
    EXPECT_LE(best_delay, milliseconds(150)) << mia::kJointNames[joint];
  }
}

TEST(MiaHand, SendsOnlyWhatChangedAndRefreshesOnceASecond) {
  MiaRig rig;
  const TimePoint start = transport::now();
  ASSERT_TRUE(rig.cycle(MiaRig::move(0.2, 0.2, 0.2)));
  EXPECT_EQ(rig.simulator.counters().motions, 3u);
  ASSERT_TRUE(rig.cycle(MiaRig::move(0.2, 0.2, 0.2)));
  EXPECT_EQ(rig.simulator.counters().motions, 3u) << "no change";
  ASSERT_TRUE(rig.cycle(MiaRig::move(0.2, 0.2, 0.5)));
  EXPECT_EQ(rig.simulator.counters().motions, 4u) << "one motor changed";
  while (rig.simulator.counters().motions < 7 && transport::now() < start + std::chrono::seconds(5)) {
    ASSERT_TRUE(rig.cycle(MiaRig::move(0.2, 0.2, 0.5)));
  }
  EXPECT_EQ(rig.simulator.counters().motions, 7u) << "every motor once more";
  EXPECT_GT(transport::now() - start, milliseconds(800));
  EXPECT_LT(transport::now() - start, milliseconds(1500));
  EXPECT_EQ(rig.simulator.counters().dropped_as_early, 0u);
}

TEST(MiaHand, NewestTargetReplacesWhatIsStillQueuedAndPositionsAreReadAllTheSame) {
  sim::MiaSimulatorConfig simulated;
  simulated.ack_delay = milliseconds(10);
  MiaRig rig(patient_config(), simulated);
  const std::uint64_t before = rig.simulator.counters().commands;
  int writes = 0;
  const TimePoint start = transport::now();
  while (transport::now() < start + milliseconds(500)) {
    const double q = 0.3 + 0.1 * (writes % 7);
    ASSERT_EQ(rig.hand->write(MiaRig::move(q, q, q), transport::now()), IoStatus::kDone);
    ++writes;
    ASSERT_NE(rig.turn(), IoStatus::kDisconnected);
  }
  EXPECT_GT(writes, 80);
  EXPECT_LE(rig.simulator.counters().commands - before, 51u) << "one command per 10 ms, however often one writes";
  EXPECT_GE(rig.replies, 5u) << "a quarter of the bus belongs to the positions";
  EXPECT_EQ(rig.simulator.counters().dropped_as_early, 0u) << "half duplex is kept";
  const auto counts = mia::motor_counts({}, {0.5, 0.6, 0.7});
  EXPECT_TRUE(rig.arrives(MiaRig::move(0.5, 0.6, 0.7), 2, std::round(counts[2])));
}

TEST(MiaHand, RefusesWhatHasExpiredOrIsNotFiniteOrHasTheWrongSize) {
  MiaRig rig;
  const std::uint64_t before = rig.hand->counters().commands;
  const TimePoint now = transport::now();
  HandCommand expired = MiaRig::move(0.5, 0.5, 0.5);
  expired.t_expires = now - milliseconds(1);
  HandCommand never_valid = MiaRig::move(0.5, 0.5, 0.5);
  never_valid.t_expires = {};
  HandCommand wrong_size = MiaRig::move(0.5, 0.5, 0.5);
  wrong_size.joint_count = 2;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const HandCommand& command :
       {expired, never_valid, wrong_size, MiaRig::move(0.5, nan, 0.5), MiaRig::move(infinity, 0.5, 0.5)}) {
    EXPECT_EQ(rig.hand->write(command, now), IoStatus::kRefused);
  }
  EXPECT_EQ(rig.hand->counters().commands, before) << "nothing was sent";
}

TEST(MiaHand, QueuedMotionIsNotSentAfterItsTime) {
  sim::MiaSimulatorConfig simulated;
  simulated.ack_delay = milliseconds(30);
  MiaRig rig(patient_config(), simulated);
  ASSERT_TRUE(rig.cycle(MiaRig::move(0.5, 0.5, 0.5, milliseconds(10))));
  EXPECT_EQ(rig.simulator.counters().motions, 1u);
  EXPECT_EQ(rig.hand->counters().expired, 2u);
}

TEST(MiaHand, TargetsBeyondTheLimitsEndAtTheLimits) {
  MiaRig rig;
  EXPECT_TRUE(rig.arrives(MiaRig::move(9.0, 9.0, 9.0), 2, 255.0));
  EXPECT_TRUE(rig.arrives(MiaRig::move(9.0, 9.0, 9.0), 1, std::round(mia::index_counts({}, 1.4))));
  EXPECT_TRUE(rig.arrives(MiaRig::move(-9.0, -9.0, -9.0), 2, 0.0));
  EXPECT_TRUE(rig.arrives(MiaRig::move(-9.0, -9.0, -9.0), 0, 0.0));
}

TEST(MiaHand, FlexesTheIndexOnTheOtherBranchForALateralThumb) {
  MiaRig rig(patient_config());
  const double counts = std::round(mia::index_counts({}, -1.0));
  ASSERT_LT(counts, -150.0);
  ASSERT_TRUE(rig.arrives(MiaRig::move(0.0, -1.0, 0.0), 1, counts));
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  EXPECT_NEAR(rig.state.q_rad[1], -1.0, 0.01);
  EXPECT_NEAR(rig.hand->thumb_opposition(), -0.6283, 1e-6);
}

TEST(MiaHand, ReadAndWriteDoNotTouchTheHeap) {
  if (!counts_heap()) GTEST_SKIP() << "sanitizers own malloc";
  MiaRig rig(quick_config());
  const std::uint64_t control = heap_allocations();
  { const std::string proof(100, 'x'); }
  ASSERT_GT(heap_allocations(), control) << "the counter counts";

  rig.simulator.garble_next(2);
  std::uint64_t used = 0;
  const TimePoint start = transport::now();
  for (int i = 0; transport::now() < start + milliseconds(500); ++i) {
    const double q = 0.1 * (i % 10);
    HandCommand command = MiaRig::move(q, q, q);
    if (i == 30) command.action = HandAction::kStop;
    if (i == 40) command.action = HandAction::kHold;
    const std::uint64_t before = heap_allocations();
    ASSERT_NE(rig.hand->write(command, transport::now()), IoStatus::kDisconnected);
    const IoStatus status = rig.hand->read(rig.state);
    used += heap_allocations() - before;
    if (status == IoStatus::kDone) ++rig.replies;
    static_cast<void>(transport::wait_readable(rig.info.fd, transport::now() + milliseconds(3)));
  }
  EXPECT_GT(rig.replies, 5u);
  EXPECT_EQ(used, 0u);
}

TEST(MiaHand, WorksAlthoughAnotherProgramLeftTheDataStreamsOn) {
  sim::MiaSimulatorConfig simulated;
  simulated.stream_hz = 200.0;
  sim::MiaSimulator simulator(simulated);
  ASSERT_TRUE(simulator.start().ok());
  {
    auto other = transport::open_tty(simulator.device());
    ASSERT_TRUE(other.ok());
    for (const char* stream : {"ADP1", "ADA1", "ADC1"}) {
      const mia::Command command = mia::encode_plain(stream);
      const std::uint64_t acks = simulator.counters().acks;
      ASSERT_EQ(transport::write_tty(other->fd.get(), std::as_bytes(std::span(command))), IoStatus::kDone);
      const TimePoint deadline = transport::now() + std::chrono::seconds(5);
      while (simulator.counters().acks == acks && transport::now() < deadline) {
        static_cast<void>(transport::wait_readable(other->fd.get(), transport::now() + milliseconds(1)));
      }
    }
  }
  mia::MiaConfig config = patient_config();
  config.device = simulator.device();
  mia::MiaHand hand(config);
  const auto info = hand.connect();
  ASSERT_TRUE(info.ok()) << info.error().detail.view();
  ASSERT_EQ(hand.write(MiaRig::move(0.3, 0.3, 0.3), transport::now()), IoStatus::kDone);
  HandDeviceState state;
  const TimePoint deadline = transport::now() + std::chrono::seconds(5);
  while (hand.counters().replies < 1 && transport::now() < deadline) {
    static_cast<void>(transport::wait_readable(info->fd, transport::now() + milliseconds(5)));
    ASSERT_NE(hand.read(state), IoStatus::kDisconnected);
  }
  EXPECT_EQ(hand.counters().replies, 1u);
  EXPECT_EQ(hand.counters().timeouts, 0u);
  EXPECT_EQ(hand.counters().mismatches, 0u) << "connecting switched the streams off";
}

TEST(MiaHand, ConnectSaysWhenNobodyAnswers) {
  const auto pty = transport::open_pty();
  ASSERT_TRUE(pty.ok());
  mia::MiaConfig config;
  config.device = pty->device;
  mia::MiaHand hand(config);
  const TimePoint start = transport::now();
  const auto info = hand.connect();
  ASSERT_FALSE(info.ok());
  EXPECT_EQ(info.error().code, Errc::kTimeout);
  EXPECT_LT(transport::now() - start, milliseconds(2500));
  HandDeviceState state;
  EXPECT_EQ(hand.read(state), IoStatus::kDisconnected);
}

TEST(MiaHand, ConnectRefusesAnUnusableConfiguration) {
  const auto refused = [](auto change) {
    mia::MiaConfig config;
    change(config);
    const auto info = mia::MiaHand(config).connect();
    return !info.ok() && info.error().code == Errc::kInvalidArgument;
  };
  EXPECT_TRUE(refused([](mia::MiaConfig& c) { c.speed_percent = 0; }));
  EXPECT_TRUE(refused([](mia::MiaConfig& c) { c.speed_percent = 100; }));
  EXPECT_TRUE(refused([](mia::MiaConfig& c) { c.max_rad[1] = -2.0; }));
  EXPECT_TRUE(refused([](mia::MiaConfig& c) { c.min_rad[0] = std::nan(""); }));
  EXPECT_TRUE(refused([](mia::MiaConfig& c) { c.ack_timeout = Duration::zero(); }));
  EXPECT_TRUE(refused([](mia::MiaConfig& c) { c.lost_after_timeouts = 0; }));
  EXPECT_TRUE(refused([](mia::MiaConfig& c) { c.transmission.thumb.rad_per_count = -1.0; }));
}

TEST(MiaHand, HoldDropsWhatIsStillQueued) {
  sim::MiaSimulatorConfig simulated;
  simulated.ack_delay = milliseconds(20);
  MiaRig rig(patient_config(), simulated);
  ASSERT_EQ(rig.hand->write(MiaRig::move(0.5, 0.5, 0.5), transport::now()), IoStatus::kDone);
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  ASSERT_TRUE(rig.cycle(MiaRig::plain(HandAction::kHold)));
  EXPECT_EQ(rig.simulator.counters().motions, 1u) << "one was on the wire already";
}

}  // namespace
}  // namespace embody::test
