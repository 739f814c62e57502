// The serial driver on CAN: profile "ascii-tunnel" in both framings, over the double.
#include <cmath>

#include "tests/support/heap_counter.hpp"
#include "tests/unit/can/rig.hpp"

namespace embody::test {
namespace {

struct TunnelRig {
  explicit TunnelRig(mia::CanFraming framing, sim::MiaSimulatorConfig hand = {}) {
    tunnel.interface = double_name();
    tunnel.framing = framing;
    simulator.emplace(sim::CanSimulatorConfig{.interface = tunnel.interface,
                                              .profile = sim::CanProfile::kTunnel,
                                              .tunnel = tunnel,
                                              .serial_hand = hand,
                                              .compact_hand = {}});
    const Status started = simulator->start();
    EXPECT_TRUE(started.ok()) << started.error().detail.view();
    config.device = tunnel.interface;
    config.ack_timeout = milliseconds(150);  // tests of other things must not trip over a busy machine
  }
  mia::CanTunnelConfig tunnel;
  mia::MiaConfig config;
  std::optional<sim::MiaCanSimulator> simulator;
};

class CanTunnel : public ::testing::TestWithParam<mia::CanFraming> {};
INSTANTIATE_TEST_SUITE_P(Framings, CanTunnel, ::testing::Values(mia::CanFraming::kIsoTp, mia::CanFraming::kSegments),
                         [](const auto& with) { return with.param == mia::CanFraming::kIsoTp ? "isoTp" : "segments"; });

TEST_P(CanTunnel, TheSerialDriverMovesTheHandAndDoesNotNoticeTheWire) {
  sim::MiaSimulatorConfig hand_config;
  hand_config.start_counts = {20.0, -30.0, 40.0};
  TunnelRig rig(GetParam(), hand_config);
  mia::MiaHand hand(rig.config, mia::can_line(rig.tunnel));
  const auto info = hand.connect();
  ASSERT_TRUE(info.ok()) << info.error().detail.view();
  EXPECT_EQ(rig.simulator->counters().motions, 0u) << "nothing moves on connect";
  EXPECT_EQ(rig.simulator->motor_counts(), hand_config.start_counts);

  HandLoop loop{hand, info->fd};
  const auto counts = mia::motor_counts({}, {0.5, 0.6, 0.7});
  const auto there = [&] {
    const auto now = rig.simulator->motor_counts();
    return std::abs(now[0] - counts[0]) < 1.0 && std::abs(now[1] - counts[1]) < 1.0 &&
           std::abs(now[2] - counts[2]) < 1.0;
  };
  TimePoint next = transport::now();
  ASSERT_TRUE(loop.until([&] {
    if (transport::now() >= next) {
      EXPECT_EQ(hand.write(move(0.5, 0.6, 0.7), transport::now()), IoStatus::kDone);
      next = transport::now() + milliseconds(50);
    }
    return there();
  }));
  const std::uint64_t replies = loop.replies;
  ASSERT_EQ(hand.write(plain(HandAction::kHold), transport::now()), IoStatus::kDone);
  ASSERT_TRUE(loop.until([&] { return loop.replies > replies; }));
  EXPECT_NEAR(loop.state.q_rad[2], 0.7, 0.02);
  EXPECT_EQ(hand.counters().mismatches, 0u);

  ASSERT_EQ(hand.write(plain(HandAction::kStop), transport::now()), IoStatus::kDone);
  EXPECT_TRUE(loop.until([&] { return rig.simulator->counters().stops > 0; }));
}

TEST_P(CanTunnel, TheDestructorStopsTheHand) {
  TunnelRig rig(GetParam());
  {
    mia::MiaHand hand(rig.config, mia::can_line(rig.tunnel));
    ASSERT_TRUE(hand.connect().ok());
  }
  EXPECT_GE(rig.simulator->counters().stops, 1u);
}

TEST_P(CanTunnel, AnInterfaceThatGoesDownEndsTheSessionAndComesBackWithoutMotion) {
  TunnelRig rig(GetParam());
  mia::MiaHand hand(rig.config, mia::can_line(rig.tunnel));
  auto info = hand.connect();
  ASSERT_TRUE(info.ok());
  ASSERT_TRUE(rig.simulator->fault("down").ok());
  const auto took = HandLoop{hand, info->fd}.end();
  ASSERT_TRUE(took.has_value());
  EXPECT_LT(*took, milliseconds(100));
  EXPECT_FALSE(hand.reason().empty());
  EXPECT_EQ(hand.connect().error().code, Errc::kDisconnected);
  ASSERT_TRUE(rig.simulator->fault("up").ok());
  const auto before = rig.simulator->motor_counts();
  info = hand.connect();
  ASSERT_TRUE(info.ok()) << info.error().detail.view();
  EXPECT_EQ(rig.simulator->counters().motions, 0u);
  EXPECT_EQ(rig.simulator->motor_counts(), before);
}

TEST_P(CanTunnel, LostAndGarbledLinesAreSurvived) {
  TunnelRig rig(GetParam());
  rig.config.ack_timeout = milliseconds(20);
  mia::MiaHand hand(rig.config, mia::can_line(rig.tunnel));
  const auto info = hand.connect();
  ASSERT_TRUE(info.ok());
  HandLoop loop{hand, info->fd};
  for (const char* fault : {"drop 1", "garble 1", "drop_ack 1", "garble 2"}) {
    ASSERT_TRUE(rig.simulator->fault(fault).ok());
    const std::uint64_t replies = loop.replies;
    TimePoint next = transport::now();
    EXPECT_TRUE(loop.until([&] {
      if (transport::now() >= next) {
        static_cast<void>(hand.write(plain(HandAction::kHold), transport::now()));
        next = transport::now() + milliseconds(50);
      }
      return loop.replies >= replies + 2;
    })) << fault
        << ": " << hand.reason();
  }
}

TEST_P(CanTunnel, SendingAndReceivingDoNotAllocate) {
  if (!counts_heap()) GTEST_SKIP() << "a sanitizer owns malloc";
  TunnelRig rig(GetParam());
  auto line = mia::can_line(rig.tunnel)();
  ASSERT_TRUE(line.ok());
  const mia::Command ask = mia::encode_plain(mia::kReadPositionsPayload);
  const std::uint64_t before = heap_allocations();
  int lines = 0;
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ((*line)->send(ask), IoStatus::kDone);
    const TimePoint deadline = transport::now() + seconds(2);
    for (int got = 0; got < 2 && transport::now() < deadline;) {
      static_cast<void>(transport::wait_readable((*line)->fd(), deadline));
      std::string_view text;
      if ((*line)->receive(text) == IoStatus::kDone) ++got, ++lines;
    }
  }
  EXPECT_EQ(heap_allocations(), before);
  EXPECT_EQ(lines, 40) << "ACK and data of each";
}

TEST(CanTunnelSetup, RefusesIdentifiersThatCannotWork) {
  for (const mia::CanFraming framing : {mia::CanFraming::kIsoTp, mia::CanFraming::kSegments}) {
    mia::CanTunnelConfig config;
    config.interface = double_name();
    config.framing = framing;
    config.rx = config.tx;
    EXPECT_EQ(mia::open_tunnel(config).error().code, Errc::kInvalidArgument);
    config.rx = {0x1000, false};
    EXPECT_EQ(mia::open_tunnel(config).error().code, Errc::kInvalidArgument);
  }
}

TEST(CanTunnelBusOff, EndsTheSession) {  // ISO-TP sockets see no error frames: there the ACKs stay away
  TunnelRig rig(mia::CanFraming::kSegments);
  mia::MiaHand hand(rig.config, mia::can_line(rig.tunnel));
  const auto info = hand.connect();
  ASSERT_TRUE(info.ok());
  ASSERT_TRUE(rig.simulator->fault("bus_off").ok());
  const auto took = HandLoop{hand, info->fd}.end();
  ASSERT_TRUE(took.has_value());
  EXPECT_LT(*took, milliseconds(100));
}

}  // namespace
}  // namespace embody::test
