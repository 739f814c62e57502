// Frames over real sockets: byte orders, TCP and UDP, one at a time, and under a client's control.
#include <gtest/gtest.h>

#include "drivers/transport/clock.hpp"
#include "tests/unit/sim_qtm/support.hpp"

namespace embody::sim {
namespace {

using test::counting_motion;
using test::Lab;
using test::RawClient;
using test::Received;
using test::UdpReceiver;
using test::WireFrame;

constexpr std::uint32_t kNoMoreData = 4;

std::vector<std::string> names(std::size_t count) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < count; ++i) names.push_back("m" + std::to_string(i));
  return names;
}

/// Number of the frame as its markers tell it.
std::uint32_t told_by(const WireFrame& frame, std::size_t marker = 0, std::size_t stride = 12) {
  return static_cast<std::uint32_t>(std::lround(8.0F * frame.point(marker, stride)[1])) + 1;
}

TEST(QtmStreaming, Serves64MarkersAt1000HzFromAFunctionWithoutALostFrame) {
  Lab lab(counting_motion(names(64), 1000.0, 1000));
  RawClient client(lab.server.port());
  client.ready().send("StreamFrames AllFrames 3DRes");
  EXPECT_EQ(client.next().type(), kNoMoreData);
  lab.server.play();
  for (std::uint32_t k = 0; k < 1000; ++k) {
    const WireFrame frame = client.next_frame();
    ASSERT_EQ(frame.number, k + 1);
    EXPECT_EQ(frame.timestamp_us, 1000U * k);
    ASSERT_EQ(frame.count(), 64U);
    EXPECT_EQ(told_by(frame, 63, 16), frame.number);
  }
  EXPECT_EQ(client.next().type(), kNoMoreData);
  EXPECT_EQ(client.next().event(), 4);
  EXPECT_FALSE(client.saw_partial_packet()) << "one send() per packet";
}

TEST(QtmStreaming, SaysTheSameInBothByteOrders) {
  QtmServerConfig config;
  config.big_endian_port = 0;
  Motion motion = counting_motion({"hand_top", "hand_left", "hand_right"}, 500.0, 20);
  motion.generate = [inner = motion.generate](std::size_t frame, std::span<Marker> markers) {
    inner(frame, markers);
    markers[0].p_W.z() += 0.05;
    markers[1].visible = frame % 2 == 0;
  };
  Lab lab(std::move(motion), config);
  RawClient little(lab.server.port());
  RawClient big(lab.server.big_endian_port(), ByteOrder::kBig);
  EXPECT_EQ(big.ready().reply("ByteOrder"), "Byte order is big endian");
  EXPECT_EQ(little.ready().reply("GetParameters All"), big.reply("GetParameters All"));
  for (RawClient* client : {&little, &big}) client->send("StreamFrames AllFrames 3D 6D 6DEulerRes 3DRes Skeleton");
  for (RawClient* client : {&little, &big}) EXPECT_EQ(client->next().type(), kNoMoreData);
  lab.server.play();
  for (std::uint32_t k = 0; k < 20; ++k) {
    const WireFrame a = little.next_frame();
    const WireFrame b = big.next_frame();
    EXPECT_EQ(a.number, k + 1);
    EXPECT_EQ(b.number, k + 1);
    EXPECT_EQ(a.timestamp_us, b.timestamp_us);
    ASSERT_EQ(a.components.size(), 5U);
    ASSERT_EQ(b.components.size(), 5U);
    EXPECT_EQ(a.missing(1), k % 2 == 1);
    for (std::size_t i = 0; i < 5; ++i) {
      const test::Reader x(a.components[i].bytes, ByteOrder::kLittle);
      const test::Reader y(b.components[i].bytes, ByteOrder::kBig);
      ASSERT_EQ(a.components[i].bytes.size(), b.components[i].bytes.size());
      for (std::size_t at = 0; at < a.components[i].bytes.size(); at += 4) EXPECT_EQ(x.u32(at), y.u32(at));
    }
  }
}

TEST(QtmStreaming, StreamsOverUdpToItsClientAndElsewhereWhileCommandsStayOnTcp) {
  Lab lab(counting_motion(names(3), 500.0, 100));
  RawClient own(lab.server.port());
  RawClient other(lab.server.port());
  UdpReceiver first;
  UdpReceiver second;
  own.ready().send("StreamFrames AllFrames UDP:" + std::to_string(first.port()) + " 3D");
  other.ready().send("StreamFrames FrequencyDivisor:10 UDP:127.0.0.1:" + std::to_string(second.port()) + " 3D 3DRes");
  EXPECT_EQ(own.next().type(), kNoMoreData) << "over TCP";
  EXPECT_EQ(other.next().type(), kNoMoreData);
  lab.server.play();
  EXPECT_EQ(own.next().event(), 3);
  for (std::uint32_t k = 0; k < 100; ++k) EXPECT_EQ(take_apart(first.next()).number, k + 1);
  for (std::uint32_t k = 0; k < 10; ++k) {
    const WireFrame frame = take_apart(second.next());
    EXPECT_EQ(frame.number, 10 * k + 1);
    EXPECT_EQ(frame.components.size(), 2U);
  }
  EXPECT_EQ(own.next().type(), kNoMoreData);
  EXPECT_EQ(own.next().event(), 4);
}

TEST(QtmStreaming, StopsDatagramsOnRequestAndWithTheTcpConnection) {
  Lab lab(counting_motion(names(1), 500.0, {}));
  lab.server.play();
  UdpReceiver udp;
  const std::string stream = "StreamFrames AllFrames UDP:" + std::to_string(udp.port()) + " 3D";
  const auto dries_up = [&udp] {
    return test::eventually([&udp] { return udp.next(std::chrono::milliseconds(100)).empty(); });
  };
  {
    RawClient client(lab.server.port());
    client.ready().send(stream);
    EXPECT_FALSE(udp.next().empty());
    client.send("StreamFrames Stop");
    EXPECT_TRUE(dries_up());
    client.send(stream);
    EXPECT_FALSE(udp.next().empty());
  }
  EXPECT_TRUE(dries_up());
}

TEST(QtmStreaming, SendsNoDatagramToOtherComputersUnlessConfigured) {
  Lab lab(counting_motion(names(1), 100.0, {}));
  RawClient client(lab.server.port());
  client.ready();
  for (const char* address : {"192.0.2.1", "255.255.255.255", "0.0.0.0", "localhost", "127.0.0.1.5"}) {
    const auto refusal = client.ask(std::string("StreamFrames AllFrames UDP:") + address + ":4000 3D");
    EXPECT_EQ(refusal.type(), 0U);
    EXPECT_EQ(refusal.text(), std::string("UDP address '") + address + "' not allowed");
  }
  EXPECT_FALSE(lab.server.has_streaming_client());
}

TEST(QtmStreaming, HandsOutEachFrameOnceToAClientThatAsksForTheCurrentOne) {
  Lab lab(counting_motion(names(2), 200.0, 100));
  RawClient client(lab.server.port());
  client.ready().send("GetCurrentFrame 3D");
  EXPECT_EQ(client.next().type(), kNoMoreData);
  lab.server.play();
  EXPECT_EQ(client.next().event(), 3);
  std::uint32_t last = 0;
  while (true) {
    client.send("GetCurrentFrame 3DRes");
    Received packet = client.next();
    if (packet.event() == 4) packet = client.next();  // the end came before the question
    if (packet.type() != 3) {
      EXPECT_EQ(packet.type(), kNoMoreData) << "the measurement has ended";
      break;
    }
    const WireFrame frame = take_apart(packet);
    EXPECT_GT(frame.number, last) << "it waits for a new one";
    EXPECT_EQ(frame.components[0].type, 9U);
    last = frame.number;
  }
  EXPECT_GT(last, 0U);
}

TEST(QtmStreaming, TheSubscriptionSurvivesTheEndOfAMeasurementUnderAMastersControl) {
  Lab lab(counting_motion(names(2), 500.0, 10));
  RawClient watcher(lab.server.port());
  RawClient master(lab.server.port());
  watcher.ready().send("StreamFrames AllFrames 3D");
  EXPECT_EQ(watcher.next().type(), kNoMoreData);
  EXPECT_EQ(master.ready().reply("TakeControl"), "You are now master");
  for (int measurement = 0; measurement < 3; ++measurement) {
    EXPECT_EQ(master.reply("Start"), "Starting measurement");
    EXPECT_EQ(watcher.next().event(), 3);
    for (std::uint32_t k = 0; k < 10; ++k) {
      const WireFrame frame = watcher.next_frame();
      EXPECT_EQ(frame.number, k + 1) << "numbers start again";
      EXPECT_EQ(told_by(frame), k + 1);
    }
    EXPECT_EQ(watcher.next().type(), kNoMoreData);
    EXPECT_EQ(watcher.next().event(), 4);
    EXPECT_EQ(master.reply("Close"), "Closing file");
    EXPECT_EQ(watcher.next().event(), 2);
    EXPECT_EQ(watcher.reply("GetParameters 3D"), "Parameters not available");
    EXPECT_EQ(master.reply("New"), "Creating new connection");
    EXPECT_EQ(watcher.next().event(), 1);
  }
}

TEST(QtmStreaming, AMasterStopsAMeasurementWithNoMoreDataForAll) {
  Lab lab(counting_motion(names(1), 100.0, {}));
  RawClient watcher(lab.server.port());
  RawClient master(lab.server.port());
  watcher.ready().send("StreamFrames AllFrames 3D");
  master.ready().ask("TakeControl");
  lab.server.play();
  watcher.next_frame();
  EXPECT_EQ(master.reply("Stop"), "Stopping measurement");
  Received packet = watcher.next();
  while (packet.type() == 3) packet = watcher.next();
  EXPECT_EQ(packet.type(), kNoMoreData);
  EXPECT_EQ(watcher.next().event(), 4);
  EXPECT_EQ(watcher.ask("GetState", /*event=*/true).event(), 4);
}

TEST(QtmStreaming, ReportsTheResultOfACalibrationToTheOneWhoAsked) {
  QtmServerConfig config;
  config.calibrated = false;
  config.calibration_time = std::chrono::milliseconds(20);
  Lab lab(counting_motion(names(1), 100.0, 5), config);
  RawClient master(lab.server.port());
  EXPECT_EQ(master.ready().reply("TakeControl"), "You are now master");
  EXPECT_NE(master.reply("GetParameters Calibration").find("calibrated=\"false\""), std::string::npos);
  EXPECT_EQ(master.reply("Calibrate"), "Starting calibration");
  EXPECT_EQ(master.next().event(), 6);
  EXPECT_EQ(master.next().event(), 7);
  const Received result = master.next();
  EXPECT_EQ(result.type(), 2U);
  EXPECT_NE(result.text().find("calibrated=\"true\""), std::string::npos);
}

TEST(QtmStreaming, LoopsWithTimeStampsThatStartAgain) {
  QtmServerConfig config;
  config.loop = true;
  Lab lab(counting_motion(names(1), 500.0, 7), config);
  RawClient client(lab.server.port());
  client.ready().send("StreamFrames AllFrames 3D");
  EXPECT_EQ(client.next().type(), kNoMoreData);
  lab.server.play();
  for (std::uint32_t k = 0; k < 30; ++k) {
    const WireFrame frame = client.next_frame();
    EXPECT_EQ(frame.number, k % 7 + 1);
    EXPECT_EQ(told_by(frame), frame.number);
    EXPECT_EQ(frame.timestamp_us, 2000U * (k % 7));
  }
  EXPECT_FALSE(lab.server.finished());
}

TEST(QtmStreaming, FollowsAFaultScriptFrameByFrameInEveryMeasurement) {
  Lab lab(counting_motion({"a", "b"}, 500.0, 50));
  EXPECT_FALSE(lab.server.set_fault_script("5 hide nobody").ok());
  EXPECT_FALSE(lab.server.set_fault_script("5 explode").ok());
  ASSERT_TRUE(lab.server.set_fault_script("5 drop a 3\n0.04s nan 2\n30 swap a b\n45 swap a b").ok());
  RawClient client(lab.server.port());
  client.ready().send("StreamFrames AllFrames 3D");
  EXPECT_EQ(client.next().type(), kNoMoreData);
  lab.server.play();
  for (int measurement = 0; measurement < 2; ++measurement) {
    for (std::uint32_t k = 0; k < 50; ++k) {
      const WireFrame frame = client.next_frame();
      ASSERT_EQ(frame.number, k + 1);
      EXPECT_EQ(frame.missing(0), (k >= 5 && k < 8) || (k >= 20 && k < 22)) << k;
      EXPECT_EQ(frame.missing(1), k >= 20 && k < 22) << k;
      if (!frame.missing(0)) {
        EXPECT_EQ(frame.point(0)[0], k >= 30 && k < 45 ? 1.0F : 0.0F) << k;
      }
    }
    if (measurement > 0) break;
    client.ask("TakeControl");
    client.ask("Close");
    client.ask("New");
    EXPECT_EQ(client.reply("Start"), "Starting measurement");
  }
}

}  // namespace
}  // namespace embody::sim
