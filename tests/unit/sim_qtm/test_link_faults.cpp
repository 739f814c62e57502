// Faults of connections and datagrams, over real sockets.
#include <gtest/gtest.h>

#include "drivers/transport/clock.hpp"
#include "tests/unit/sim_qtm/support.hpp"

namespace embody::sim {
namespace {

using test::counting_motion;
using test::Lab;
using test::RawClient;
using test::take_apart;
using test::UdpReceiver;

TEST(LinkFaults, AHalfOpenServerIsSilentAndComesBack) {
  Lab lab(counting_motion({"a"}, 200.0, {}));
  RawClient client(lab.server.port());
  client.ready().send("StreamFrames AllFrames 3D");
  lab.server.play();
  std::uint32_t last = client.next_frame().number;
  ASSERT_TRUE(lab.server.fault("half_open on").ok());
  RawClient late(lab.server.port());  // the kernel accepts it
  late.send("Version 1.25");
  EXPECT_TRUE(late.silent_for(std::chrono::milliseconds(100)));
  ASSERT_TRUE(lab.server.fault("half_open off").ok());
  std::uint32_t widest = 0;
  for (int i = 0; i < 60; ++i) {
    const auto number = client.next_frame().number;
    widest = std::max(widest, number - last);
    last = number;
  }
  EXPECT_GT(widest, 15U) << "the frames of the silence are lost";
  EXPECT_EQ(late.next().text(), "QTM RT Interface connected");
  EXPECT_EQ(late.next().text(), "Version set to 1.25");
}

TEST(LinkFaults, AnEventStormSurroundsTheParameters) {
  Lab lab(counting_motion({"a"}, 100.0, 5));
  RawClient client(lab.server.port());
  client.ready();
  ASSERT_TRUE(lab.server.fault("event_storm").ok());
  client.send("GetParameters 3D");
  int before = 0;
  auto packet = client.next();
  for (; packet.type() == 6; packet = client.next()) ++before;
  EXPECT_EQ(packet.type(), 2U);
  EXPECT_GE(before, 10);
  for (int i = 0; i < before; ++i) EXPECT_EQ(client.next().event(), 11);
  EXPECT_EQ(client.reply("ByteOrder"), "Byte order is little endian");
  ASSERT_TRUE(lab.server.fault("event_storm off").ok());
  client.send("GetParameters 3D");
  EXPECT_EQ(client.next().type(), 2U);
}

TEST(LinkFaults, AnEventReachesEverybodyOnceAndIsNoState) {
  Lab lab(counting_motion({"a"}, 100.0, 5));
  RawClient a(lab.server.port());
  RawClient b(lab.server.port());
  a.ready();
  b.ready();
  ASSERT_TRUE(lab.server.fault("event 12").ok());
  EXPECT_EQ(a.next().event(), 12);
  EXPECT_EQ(b.next().event(), 12);
  EXPECT_EQ(a.ask("GetState", /*event=*/true).event(), 1);
}

TEST(LinkFaults, ParametersChangeWithoutAnEvent) {
  Lab lab(counting_motion({"a", "b"}, 100.0, 5));
  RawClient client(lab.server.port());
  client.ready();
  const std::string sound = client.reply("GetParameters 3D");
  for (const char* words :
       {"reorder", "add_label c", "remove_label a", "rename_label b d", "axis +Y", "uncalibrated"}) {
    const std::string before = client.reply("GetParameters 3D");
    ASSERT_TRUE(lab.server.fault(words).ok()) << words;
    client.send("GetParameters 3D");
    const auto next = client.next();
    EXPECT_EQ(next.type(), 2U) << "no event first";
    EXPECT_NE(next.text(), before) << words;
  }
  EXPECT_FALSE(lab.server.fault("nonsense").ok());
  EXPECT_FALSE(lab.server.fault("hide nobody").ok());
}

/// A client that gets datagrams of a motion without end.
struct UdpStream {
  UdpStream() : lab(counting_motion({"a"}, 200.0, {})), client(lab.server.port()) {
    client.ready().send("StreamFrames AllFrames UDP:" + std::to_string(udp.port()) + " 3D 3DRes");
    lab.server.play();
  }
  /// Numbers of the next `count` datagrams, from the first on for which the fault is certain to act.
  std::vector<std::uint32_t> numbers(std::size_t count) {
    for (int i = 0; i < 20; ++i) udp.next();
    std::vector<std::uint32_t> numbers;
    while (numbers.size() < count) {
      const auto frame = take_apart(udp.next());
      numbers.push_back(frame.number);
      components = frame.components.size();
    }
    return numbers;
  }
  Lab lab;
  RawClient client;
  UdpReceiver udp;
  std::size_t components{0};
};

TEST(LinkFaults, DatagramsAreSplitByComponent) {
  UdpStream stream;
  ASSERT_TRUE(stream.lab.server.fault("split_udp on").ok());
  const auto numbers = stream.numbers(21);
  EXPECT_EQ(stream.components, 1U);
  for (std::size_t i = 2; i < numbers.size(); ++i) EXPECT_EQ(numbers[i], numbers[i - 2] + 1);
}

TEST(LinkFaults, DatagramsAreExchangedInPairs) {
  UdpStream stream;
  ASSERT_TRUE(stream.lab.server.fault("reorder_udp on").ok());
  const auto numbers = stream.numbers(21);
  int backwards = 0;
  for (std::size_t i = 1; i < numbers.size(); ++i) {
    backwards += numbers[i] < numbers[i - 1] ? 1 : 0;
    EXPECT_TRUE(numbers[i] + 1 == numbers[i - 1] || numbers[i] == numbers[i - 1] + 3);
  }
  EXPECT_EQ(backwards, 10);
}

TEST(LinkFaults, DatagramsArriveTwice) {
  UdpStream stream;
  ASSERT_TRUE(stream.lab.server.fault("duplicate_udp on").ok());
  const auto numbers = stream.numbers(20);
  for (std::size_t i = 2; i < numbers.size(); ++i) EXPECT_EQ(numbers[i], numbers[i - 2] + 1);
}

TEST(LinkFaults, AStallEndsInABurst) {
  Lab lab(counting_motion({"a"}, 100.0, {}));
  RawClient client(lab.server.port());
  client.ready().send("StreamFrames AllFrames 3D");
  lab.server.play();
  auto last = client.next_frame().number;
  ASSERT_TRUE(lab.server.fault("stall 300").ok());
  Duration longest{0};
  auto t_last = transport::now();
  int after = 0;
  std::size_t burst = 0;
  while (after < 10) {
    const auto frame = client.next_frame();
    const auto t = transport::now();
    EXPECT_EQ(frame.number, last + 1) << "none is lost";
    if (t - t_last > std::chrono::milliseconds(150)) after = 1;
    if (after > 0 && t - t_last < std::chrono::milliseconds(5)) ++burst;
    if (after > 0) ++after;
    longest = std::max(longest, t - t_last);
    last = frame.number;
    t_last = t;
  }
  EXPECT_GT(longest, std::chrono::milliseconds(200));
  EXPECT_GT(burst, 4U);
}

}  // namespace
}  // namespace embody::sim
