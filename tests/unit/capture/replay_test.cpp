// The replayed device against plain sockets and terminals.
#include "drivers/capture/replay.hpp"

#include <sys/socket.h>

#include "drivers/transport/tty.hpp"
#include "tests/unit/capture/support.hpp"

namespace embody::capture {
namespace {

using test::bytes;
using test::eventually;

Chunk open(std::uint32_t connection, std::uint16_t port) {
  Chunk chunk;
  chunk.connection = connection;
  chunk.event = Event::kOpen;
  chunk.port = port;
  return chunk;
}
Chunk data(std::uint32_t connection, Event direction, std::string_view text, std::int64_t t_ns = 0) {
  Chunk chunk;
  chunk.connection = connection;
  chunk.event = direction;
  chunk.bytes = bytes(text);
  chunk.t_ns = t_ns;
  return chunk;
}
Chunk close(std::uint32_t connection, End by, bool reset) {
  Chunk chunk;
  chunk.connection = connection;
  chunk.event = Event::kClose;
  chunk.by = by;
  chunk.reset = reset;
  return chunk;
}
TimePoint deadline() {
  return transport::now() + std::chrono::seconds(10);
}
transport::UniqueFd connect(const ReplayDevice& device, std::uint16_t port = 0) {
  auto fd = transport::tcp_connect("127.0.0.1", device.port(port), deadline());
  EXPECT_TRUE(fd.ok());
  return fd ? std::move(*fd) : transport::UniqueFd();
}
/// The sizes in which what is sent can be received.
std::vector<std::size_t> received_sizes(int fd, ReplayDevice& device) {
  std::vector<std::size_t> sizes;
  std::array<std::byte, 256> buffer;
  while (transport::wait_readable(fd, transport::now() + std::chrono::milliseconds(device.finished() ? 0 : 200))) {
    const auto received = transport::receive(fd, buffer);
    if (received.status == IoStatus::kDone) sizes.push_back(received.size);
    if (received.status == IoStatus::kDisconnected) break;
  }
  return sizes;
}

TEST(Replay, WaitsForTheDriversBytesAndCountsWhatDiffers) {
  ReplayDevice device({{},
                       {open(1, 9), data(1, Event::kIn, "hello"), data(1, Event::kOut, "ask 1"),
                        data(1, Event::kIn, "answer"), data(1, Event::kOut, "ask 2"), data(1, Event::kIn, "end")}});
  ASSERT_TRUE(device.start().ok());
  const auto driver = connect(device);
  EXPECT_EQ(test::receive_bytes(driver.get(), 5), bytes("hello"));
  ASSERT_TRUE(eventually([&] { return device.waits_for_driver(); }));
  EXPECT_FALSE(transport::wait_readable(driver.get(), transport::now() + std::chrono::milliseconds(20)));
  ASSERT_EQ(transport::send_message(driver.get(), bytes("ask ")), IoStatus::kDone);
  EXPECT_FALSE(transport::wait_readable(driver.get(), transport::now() + std::chrono::milliseconds(20)));
  ASSERT_EQ(transport::send_message(driver.get(), bytes("X")), IoStatus::kDone);
  EXPECT_EQ(test::receive_bytes(driver.get(), 6), bytes("answer"));
  EXPECT_FALSE(device.finished());
  ASSERT_EQ(transport::send_message(driver.get(), bytes("ask 2 and more")), IoStatus::kDone);
  EXPECT_EQ(test::receive_bytes(driver.get(), 3), bytes("end"));
  EXPECT_TRUE(eventually([&] { return device.finished(); }));
  const auto report = device.report();
  EXPECT_EQ(report.connections, 1u);
  EXPECT_EQ(report.different, 1u);
  EXPECT_EQ(report.unexpected, 9u);
  EXPECT_EQ(report.sent, 14u);
}

TEST(Replay, EverySplitReachesTheDriverAsSeparateReads) {
  const std::string text = "0123456789";
  for (std::size_t offset = 0; offset <= text.size() + 1; ++offset) {
    ReplayDevice device({{}, {open(1, 9), data(1, Event::kIn, text)}}, {Chunking::two_parts(offset)});
    ASSERT_TRUE(device.start().ok());
    const auto driver = connect(device);
    const std::vector<std::size_t> expected = offset == 0 || offset >= text.size()
                                                  ? std::vector<std::size_t>{text.size()}
                                                  : std::vector<std::size_t>{offset, text.size() - offset};
    EXPECT_EQ(received_sizes(driver.get(), device), expected) << offset;
  }
  for (const std::size_t size : {1u, 3u}) {
    ReplayDevice device({{}, {open(1, 9), data(1, Event::kIn, text)}}, {Chunking::pieces(size)});
    ASSERT_TRUE(device.start().ok());
    const auto driver = connect(device);
    EXPECT_EQ(received_sizes(driver.get(), device).size(), (text.size() + size - 1) / size);
  }
}

TEST(Replay, ClosesAsTheDeviceDid) {
  for (const bool reset : {false, true}) {
    ReplayDevice device({{}, {open(1, 9), data(1, Event::kIn, "bye"), close(1, End::kDevice, reset)}});
    ASSERT_TRUE(device.start().ok());
    const auto driver = connect(device);
    EXPECT_EQ(test::receive_bytes(driver.get(), 3), bytes("bye"));
    ASSERT_TRUE(transport::wait_readable(driver.get(), deadline()));
    std::byte byte{};
    EXPECT_EQ(::recv(driver.get(), &byte, 1, MSG_DONTWAIT), reset ? -1 : 0);
    EXPECT_TRUE(eventually([&] { return device.finished(); }));
  }
}

TEST(Replay, EachPortPlaysItsConnectionsInOrderAndRefusesMore) {
  ReplayDevice device({{},
                       {open(1, 10), open(2, 20), open(3, 10), data(3, Event::kIn, "third"),
                        data(1, Event::kIn, "first"), data(2, Event::kIn, "second")}});
  ASSERT_TRUE(device.start().ok());
  const auto second = connect(device, 20);
  EXPECT_EQ(test::receive_bytes(second.get(), 6), bytes("second"));
  const auto first = connect(device, 10);
  EXPECT_EQ(test::receive_bytes(first.get(), 5), bytes("first"));
  EXPECT_FALSE(device.finished());
  const auto third = connect(device, 10);
  EXPECT_EQ(test::receive_bytes(third.get(), 5), bytes("third"));
  EXPECT_TRUE(eventually([&] { return device.finished(); }));
  const auto fourth = connect(device, 10);
  EXPECT_EQ(test::receive_bytes(fourth.get(), 1).size(), 0u);
  EXPECT_EQ(device.report().refused, 1u);
}

TEST(Replay, KeepsTheRecordedTimeWhenToldTo) {
  constexpr std::int64_t kLater_ns = 300'000'000;
  const Capture capture{{}, {open(1, 9), data(1, Event::kIn, "a"), data(1, Event::kIn, "b", kLater_ns)}};
  for (const bool recorded_time : {true, false}) {
    ReplayDevice device(capture, {Chunking::whole(), recorded_time});
    ASSERT_TRUE(device.start().ok());
    const TimePoint begin = transport::now();
    const auto driver = connect(device);
    EXPECT_EQ(test::receive_bytes(driver.get(), 2), bytes("ab"));
    EXPECT_EQ(transport::now() - begin >= std::chrono::nanoseconds(kLater_ns), recorded_time);
  }
}

TEST(Replay, ASerialDeviceAnswersAndHangsUp) {
  Capture capture{
      {}, {open(1, 0), data(1, Event::kOut, "ping"), data(1, Event::kIn, "pong\n"), close(1, End::kDevice, true)}};
  capture.header.link = LinkKind::kSerial;
  ReplayDevice device(std::move(capture), {Chunking::pieces(1)});
  ASSERT_TRUE(device.start().ok());
  auto tty = transport::open_tty(device.device());
  ASSERT_TRUE(tty.ok()) << tty.error().detail.view();
  ASSERT_EQ(transport::write_tty(tty->fd.get(), bytes("ping")), IoStatus::kDone);
  std::string text;
  std::array<std::byte, 64> buffer;
  EXPECT_TRUE(eventually([&] {
    const auto received = transport::read_tty(tty->fd.get(), buffer);
    text.append(reinterpret_cast<const char*>(buffer.data()), received.size);
    return received.status == IoStatus::kDisconnected;
  }));
  EXPECT_EQ(text, "pong\n");
  EXPECT_TRUE(device.finished());
}

TEST(Replay, RefusesWhatItCannotPlay) {
  EXPECT_EQ(ReplayDevice({}).start().error().code, Errc::kInvalidArgument);
  Capture datagrams{{}, {open(1, 9)}};
  datagrams.header.link = LinkKind::kUdp;
  EXPECT_EQ(ReplayDevice(datagrams).start().error().code, Errc::kUnsupported);
  EXPECT_EQ(ReplayDevice({{}, {data(1, Event::kIn, "x")}}).start().error().code, Errc::kInvalidArgument);
}

}  // namespace
}  // namespace embody::capture
