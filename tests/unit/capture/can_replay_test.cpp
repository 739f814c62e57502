// A recorded bus played over the double, to plain CAN sockets.
#include "drivers/capture/can_replay.hpp"

#include "drivers/capture/can_listener.hpp"
#include "drivers/transport/can.hpp"
#include "tests/unit/capture/support.hpp"

namespace embody::capture {
namespace {

using test::eventually;
using transport::CanFrame;
using transport::CanId;

constexpr CanId kCommand{0x200}, kHeartbeat{0x20F}, kState{0x210};

CanFrame frame(CanId id, std::uint8_t value) {
  return {id, 1, {value}, {}};
}
Chunk chunk(Event event, const CanFrame& frame) {
  Chunk chunk;
  chunk.event = event;
  chunk.bytes = bytes_of(frame);
  return chunk;
}
Chunk edge(Event event) {
  Chunk chunk;
  chunk.event = event;
  chunk.by = End::kDevice;
  chunk.reset = event == Event::kClose;
  return chunk;
}
Capture can(std::vector<Chunk> chunks) {
  Capture capture{{}, std::move(chunks)};
  capture.header.link = LinkKind::kCan;
  return capture;
}

transport::CanBus open(const CanReplay& device) {
  auto bus = transport::open_can({device.interface(), {kState}});
  EXPECT_TRUE(bus.ok()) << bus.error().detail.view();
  return std::move(*bus);
}
/// The next frame's value, -1 when the bus has ended.
int hear(transport::CanBus& bus) {
  CanFrame got;
  IoStatus status = IoStatus::kEmpty;
  EXPECT_TRUE(eventually([&] { return (status = bus.receive(got)) != IoStatus::kEmpty; }));
  return status == IoStatus::kDone ? got.data[0] : -1;
}
bool hears_nothing(transport::CanBus& bus) {
  return !transport::wait_readable(bus.fd(), transport::now() + std::chrono::milliseconds(20));
}

TEST(CanReplay, AnswersEachIdentifierInTurnAndEndsAsTheDeviceDid) {
  CanReplay device(
      can({edge(Event::kOpen), chunk(Event::kOut, frame(kHeartbeat, 9)), chunk(Event::kIn, frame(kState, 1)),
           chunk(Event::kOut, frame(kCommand, 7)), chunk(Event::kIn, frame(kState, 2)), edge(Event::kClose)}),
      CanReplayAs::kFrames, {kHeartbeat});
  ASSERT_TRUE(device.start().ok());
  transport::CanBus bus = open(device);
  EXPECT_EQ(hear(bus), 1) << "nobody waits for the heartbeat";
  EXPECT_TRUE(hears_nothing(bus));
  for (int i = 0; i < 3; ++i) ASSERT_EQ(bus.send(frame(kHeartbeat, 9)), IoStatus::kDone);
  EXPECT_TRUE(hears_nothing(bus)) << "heartbeats are no command";
  EXPECT_FALSE(device.finished());
  ASSERT_EQ(bus.send(frame(kCommand, 8)), IoStatus::kDone);
  EXPECT_EQ(hear(bus), 2);
  EXPECT_EQ(hear(bus), -1);
  EXPECT_TRUE(device.finished());
  const auto report = device.report();
  EXPECT_EQ(report.connections, 1u);
  EXPECT_EQ(report.sent, 2u);
  EXPECT_EQ(report.received, 4u);
  EXPECT_EQ(report.different, 1u) << "8 for 7";
  EXPECT_EQ(report.unexpected, 2u) << "heartbeats";
}

TEST(CanReplay, TheNextFrameWaitsUntilTheLastOneIsRead) {
  std::vector<Chunk> chunks{edge(Event::kOpen)};
  for (std::uint8_t i = 0; i < 100; ++i) chunks.push_back(chunk(Event::kIn, frame(kState, i)));
  CanReplay device(can(chunks));
  ASSERT_TRUE(device.start().ok());
  transport::CanBus bus = open(device);
  ASSERT_TRUE(transport::wait_readable(bus.fd(), transport::now() + std::chrono::seconds(10)));
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(device.finished());
  EXPECT_EQ(device.report().sent, 1u);
  for (int i = 0; i < 100; ++i) ASSERT_EQ(hear(bus), i);
  EXPECT_TRUE(eventually([&] { return device.finished(); }));
  EXPECT_TRUE(hears_nothing(bus)) << "the line stays open";
}

TEST(CanReplay, ASecondDriverIsRefusedAndTheFolderGoes) {
  std::string interface;
  {
    CanReplay device(can({edge(Event::kOpen), chunk(Event::kIn, frame(kState, 1))}));
    ASSERT_TRUE(device.start().ok());
    interface = device.interface();
    transport::CanBus first = open(device);
    EXPECT_EQ(hear(first), 1);
    transport::CanBus second = open(device);
    EXPECT_EQ(hear(second), -1);
    EXPECT_EQ(device.report().refused, 1u);
  }
  EXPECT_FALSE(std::filesystem::exists(std::filesystem::path(interface.substr(5)).parent_path()));
}

TEST(CanReplay, RefusesWhatItCannotPlay) {
  EXPECT_EQ(CanReplay(Capture{}).start().error().code, Errc::kUnsupported);
  EXPECT_EQ(CanReplay(can({})).start().error().code, Errc::kInvalidArgument);
  Capture two = can({edge(Event::kOpen), edge(Event::kOpen)});
  two.chunks[1].connection = 2;
  EXPECT_EQ(CanReplay(two).start().error().code, Errc::kInvalidArgument);
  EXPECT_EQ(CanReplay(can({chunk(Event::kIn, frame(kState, 0x55))}), CanReplayAs::kIsoTpMessages).start().error().code,
            Errc::kMalformed);
}

}  // namespace
}  // namespace embody::capture
