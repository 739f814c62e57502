// In a virtual machine with a kernel that has CAN: the same drivers and simulators as over the double, on real sockets.
// EMBODY_CAN_HOST and EMBODY_CAN_HAND name the interfaces of the two ends (the same one for vcan).
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "drivers/capture/can_listener.hpp"
#include "drivers/capture/capture_text.hpp"
#include "drivers/capture/isotp_messages.hpp"
#include "drivers/transport/can_isotp.hpp"
#include "tests/unit/can/rig.hpp"

namespace embody::test {
namespace {

std::string variable(const char* name) {
  const char* text = std::getenv(name);
  return text != nullptr ? text : "";
}
const std::string kHost = variable("EMBODY_CAN_HOST");
const std::string kHand = variable("EMBODY_CAN_HAND");

void ip(const std::string& arguments) {
  ASSERT_EQ(std::system(("/usr/bin/ip " + arguments).c_str()), 0) << arguments;
}

/// The emulated machine is slow and uneven.
mia::compact::CompactConfig slow_compact() {
  mia::compact::CompactConfig config;
  config.interface = kHost;
  config.ack_timeout = milliseconds(200);
  config.state_timeout = milliseconds(1000);
  return config;
}

sim::CanSimulatorConfig compact_hand() {
  sim::CanSimulatorConfig config;
  config.interface = kHand;
  config.compact_hand.heartbeat_timeout = seconds(2);
  return config;
}

bool drive(HandDriver& hand, int fd, double q_rad, const std::function<bool()>& done) {
  HandLoop loop{hand, fd};
  TimePoint next{};
  return loop.until(
      [&] {
        if (transport::now() >= next) {
          static_cast<void>(hand.write(move(q_rad, q_rad, q_rad), transport::now()));
          next = transport::now() + milliseconds(50);
        }
        return done();
      },
      seconds(30));
}

bool arrived(const sim::MiaCanSimulator& simulator, double q_rad) {
  const auto counts = mia::motor_counts({}, {q_rad, q_rad, q_rad});
  const auto now = simulator.motor_counts();
  return std::abs(now[0] - counts[0]) < 1.0 && std::abs(now[1] - counts[1]) < 1.0 && std::abs(now[2] - counts[2]) < 1.0;
}

TEST(VmCan, FramesPassTheKernelsFiltersAndCarryItsTimeOfArrival) {
  const transport::CanId wanted{0x123, false}, other{0x124, false}, extended{0x123, true};
  auto host = transport::open_can({kHost, {wanted}});
  auto hand = transport::open_can({kHand, {wanted}});
  ASSERT_TRUE(host.ok()) << host.error().detail.view();
  ASSERT_TRUE(hand.ok()) << hand.error().detail.view();
  constexpr int kFrames = 200;
  int received = 0;
  transport::CanFrame got;
  for (int i = 0; i < kFrames; ++i) {
    for (const transport::CanId id : {other, extended, wanted}) {
      const TimePoint deadline = transport::now() + seconds(5);
      const transport::CanFrame frame{id, 8, {static_cast<std::uint8_t>(i)}, {}};
      while (host->send(frame) == IoStatus::kEmpty && transport::now() < deadline) {
        static_cast<void>(transport::wait_readable(-1, transport::now() + milliseconds(1)));  // the queue is short
      }
    }
    const TimePoint sent = transport::now();
    while (hand->receive(got) != IoStatus::kDone && transport::now() < sent + seconds(5)) {
      static_cast<void>(transport::wait_readable(hand->fd(), transport::now() + milliseconds(100)));
    }
    if (got.data[0] == static_cast<std::uint8_t>(i)) ++received;
    EXPECT_EQ(got.id, wanted);
    EXPECT_LE(got.t_arrival, transport::now());
    EXPECT_GT(got.t_arrival, sent - seconds(1));
  }
  EXPECT_EQ(received, kFrames) << "all, in order";
  EXPECT_EQ(hand->counters().ignored, 0u) << "the kernel sorts the others out";
  EXPECT_EQ(host->receive(got), IoStatus::kEmpty) << "nobody hears himself";
}

TEST(VmCan, TheCompactProfileWorksAndItsHandStopsWithTheDriver) {
  sim::MiaCanSimulator simulator(compact_hand());
  ASSERT_TRUE(simulator.start().ok());
  {
    mia::compact::MiaCanHand hand(slow_compact());
    const auto info = hand.connect();
    ASSERT_TRUE(info.ok()) << info.error().detail.view();
    EXPECT_EQ(simulator.counters().motions, 0u);
    ASSERT_TRUE(drive(hand, info->fd, 0.5, [&] { return arrived(simulator, 0.5); })) << hand.reason();
    EXPECT_EQ(hand.counters().damaged, 0u);
  }
  EXPECT_GE(simulator.counters().stops, 1u);
}

class VmCanTunnel : public ::testing::TestWithParam<mia::CanFraming> {};
INSTANTIATE_TEST_SUITE_P(Framings, VmCanTunnel, ::testing::Values(mia::CanFraming::kIsoTp, mia::CanFraming::kSegments),
                         [](const auto& with) { return with.param == mia::CanFraming::kIsoTp ? "isoTp" : "segments"; });

TEST_P(VmCanTunnel, CarriesTheSerialProtocol) {
  for (const bool extended : {false, true}) {
    mia::CanTunnelConfig tunnel;
    tunnel.interface = kHost;
    tunnel.framing = GetParam();
    tunnel.message_timeout = milliseconds(200);
    if (extended) tunnel.tx = {0x18DA10F1, true}, tunnel.rx = {0x18DAF110, true};
    sim::CanSimulatorConfig simulated;
    simulated.interface = kHand;
    simulated.profile = sim::CanProfile::kTunnel;
    simulated.tunnel = tunnel;
    sim::MiaCanSimulator simulator(simulated);
    ASSERT_TRUE(simulator.start().ok());
    mia::MiaConfig config;
    config.device = kHost;
    config.ack_timeout = milliseconds(200);
    // The emulated bus knows no bit times: a burst may overrun its controller, and a line lost during the probe would
    // make the driver take the hand for an older one.
    config.generation = mia::Generation::kAcknowledging;
    mia::MiaHand hand(config, mia::can_line(tunnel));
    const auto info = hand.connect();
    ASSERT_TRUE(info.ok()) << info.error().detail.view();
    EXPECT_EQ(simulator.counters().motions, 0u);
    const bool there = drive(hand, info->fd, 0.4, [&] { return arrived(simulator, 0.4); });
    const auto& counters = hand.counters();
    ASSERT_TRUE(there) << hand.reason() << "; commands " << counters.commands << ", ACKs " << counters.acks
                       << ", time-outs " << counters.timeouts << ", replies " << counters.replies << ", hand: commands "
                       << simulator.counters().commands << ", motions " << simulator.counters().motions << ", at "
                       << simulator.motor_counts()[0];
    EXPECT_GT(hand.counters().replies, 0u);
    std::printf("[ figures  ] %llu replies, %llu time-outs\n", static_cast<unsigned long long>(hand.counters().replies),
                static_cast<unsigned long long>(hand.counters().timeouts));
  }
}

/// What `embodyctl capture hand` does beside embodyd.
TEST_P(VmCanTunnel, AListenerBesideTheDriverHearsBothSides) {
  mia::CanTunnelConfig tunnel;
  tunnel.interface = kHost;
  tunnel.framing = GetParam();
  tunnel.message_timeout = milliseconds(200);
  sim::CanSimulatorConfig simulated;
  simulated.interface = kHand;
  simulated.profile = sim::CanProfile::kTunnel;
  simulated.tunnel = tunnel;
  sim::MiaCanSimulator simulator(simulated);
  ASSERT_TRUE(simulator.start().ok());
  capture::Header header;
  header.link = capture::LinkKind::kCan;
  const std::string path = ::testing::TempDir() + "listener.jsonl";
  auto writer = capture::CaptureWriter::open(path, true, header);
  ASSERT_TRUE(writer.ok()) << writer.error().detail.view();
  auto bus = transport::open_can({kHost, {tunnel.tx, tunnel.rx}});
  ASSERT_TRUE(bus.ok()) << bus.error().detail.view();
  capture::CanListener listener(**writer);
  listener.start(std::move(*bus), {tunnel.tx});
  mia::MiaConfig config;
  config.device = kHost;
  config.ack_timeout = milliseconds(200);
  config.generation = mia::Generation::kAcknowledging;
  mia::MiaHand hand(config, mia::can_line(tunnel));
  const auto info = hand.connect();
  ASSERT_TRUE(info.ok()) << info.error().detail.view();
  ASSERT_TRUE(drive(hand, info->fd, 0.2, [&] { return hand.counters().replies > 5; })) << hand.reason();
  ASSERT_TRUE((*writer)->close().ok());
  auto heard = capture::load_capture(path);
  ASSERT_TRUE(heard.ok()) << heard.error().detail.view();
  if (GetParam() == mia::CanFraming::kIsoTp) heard = capture::join_isotp(*heard);
  ASSERT_TRUE(heard.ok()) << heard.error().detail.view();
  int sent = 0, received = 0;
  for (const auto& chunk : heard->chunks) {
    if (chunk.event != capture::Event::kOut && chunk.event != capture::Event::kIn) continue;
    const bool out = chunk.event == capture::Event::kOut;
    const auto id = capture::bytes_of({out ? tunnel.tx : tunnel.rx, 0, {}, {}});
    EXPECT_TRUE(std::equal(id.begin(), id.end(), chunk.bytes.begin()));
    ++(out ? sent : received);
  }
  EXPECT_GT(sent, 5);
  EXPECT_GT(received, 5);
  std::printf("[ figures  ] heard %d of the host, %d of the hand\n", sent, received);
}

TEST(VmCan, AnInterfaceThatGoesDownEndsTheSessionWithASentenceAndComesBackWithoutMotion) {
  sim::MiaCanSimulator simulator(compact_hand());
  ASSERT_TRUE(simulator.start().ok());
  mia::compact::MiaCanHand hand(slow_compact());
  auto info = hand.connect();
  ASSERT_TRUE(info.ok()) << info.error().detail.view();
  ASSERT_NO_FATAL_FAILURE(ip("link set " + kHost + " down"));
  const auto took = HandLoop{hand, info->fd}.end();
  ASSERT_TRUE(took.has_value());
  EXPECT_NE(hand.reason().find("down"), std::string_view::npos) << hand.reason();
  std::printf("[ fault    ] interface down: %.0f ms, \"%.*s\"\n", 1e3 * to_seconds(*took),
              static_cast<int>(hand.reason().size()), hand.reason().data());
  const auto refused = hand.connect();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, Errc::kDisconnected) << refused.error().detail.view();
  EXPECT_NE(refused.error().detail.view().find("is down"), std::string_view::npos) << refused.error().detail.view();
  ASSERT_NO_FATAL_FAILURE(ip("link set " + kHost + " up"));
  const TimePoint deadline = transport::now() + seconds(20);
  do {
    info = hand.connect();
  } while (!info && transport::now() < deadline);
  ASSERT_TRUE(info.ok()) << info.error().detail.view();
  EXPECT_EQ(simulator.counters().motions, 0u);
  EXPECT_TRUE(drive(hand, info->fd, 0.3, [&] { return arrived(simulator, 0.3); })) << hand.reason();
}

TEST(VmCan, BusOffAsAnErrorFrameOfTheKernelEndsTheSession) {
  if (kHost != kHand) GTEST_SKIP() << "the emulated controller makes no error frames";
  sim::MiaCanSimulator simulator(compact_hand());
  ASSERT_TRUE(simulator.start().ok());
  mia::compact::MiaCanHand hand(slow_compact());
  const auto info = hand.connect();
  ASSERT_TRUE(info.ok()) << info.error().detail.view();
  ASSERT_TRUE(simulator.fault("bus_off").ok());
  ASSERT_TRUE((HandLoop{hand, info->fd}.end()).has_value());
  EXPECT_NE(hand.reason().find("bus-off"), std::string_view::npos) << hand.reason();
}

TEST(VmCan, AnInterfaceThatIsRemovedEndsABusWithASentence) {
  if (kHost != kHand) GTEST_SKIP() << "a PCI card stays";
  ASSERT_NO_FATAL_FAILURE(ip("link add dev vcan9 type vcan"));
  EXPECT_NE(transport::open_can({"vcan9", {{1, false}}}).error().detail.view().find("is down"), std::string_view::npos);
  ASSERT_NO_FATAL_FAILURE(ip("link set vcan9 up"));
  auto reader = transport::open_can({"vcan9", {{1, false}}});
  auto writer = transport::open_can({"vcan9", {{1, false}}});
  auto isotp = transport::open_isotp({"vcan9", {2, false}, {3, false}});
  ASSERT_TRUE(reader.ok() && writer.ok() && isotp.ok());
  ASSERT_NO_FATAL_FAILURE(ip("link del dev vcan9"));
  // An interface goes down before it is removed: either word will do.
  transport::CanFrame frame{{1, false}, 0, {}, {}};
  EXPECT_EQ(reader->receive(frame), IoStatus::kDisconnected);
  EXPECT_FALSE(reader->reason().empty());
  EXPECT_EQ(writer->send(frame), IoStatus::kDisconnected);
  EXPECT_FALSE(writer->reason().empty());
  std::array<char, 16> buffer{};
  EXPECT_EQ(isotp->receive(buffer).status, IoStatus::kDisconnected);
  EXPECT_EQ(transport::find_can_interface("vcan9").error().code, Errc::kNotFound);
}

TEST(VmCan, AMessageThatNobodyAcceptsIsLostAndNotTheEnd) {
  auto lonely = transport::open_isotp({kHost, {0x7A0, false}, {0x7A1, false}});
  ASSERT_TRUE(lonely.ok()) << lonely.error().detail.view();
  const std::string message(40, 'x');
  ASSERT_EQ(lonely->send(message), IoStatus::kDone);
  EXPECT_EQ(lonely->send(message), IoStatus::kEmpty) << "the first waits for its flow control";
  std::array<char, 64> buffer{};
  const TimePoint deadline = transport::now() + seconds(10);
  while (lonely->counters().lost == 0 && transport::now() < deadline) {
    static_cast<void>(transport::wait_readable(lonely->fd(), transport::now() + milliseconds(100)));
    ASSERT_EQ(lonely->receive(buffer).status, IoStatus::kEmpty);
  }
  EXPECT_EQ(lonely->counters().lost, 1u);
  EXPECT_EQ(lonely->send(message), IoStatus::kDone) << "and the line is usable";
}

}  // namespace
}  // namespace embody::test
