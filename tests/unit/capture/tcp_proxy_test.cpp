// The TCP proxy against plain sockets: bytes, half-closes, resets and refusals arrive as without it.
#include <sys/socket.h>

#include <random>

#include "drivers/capture/tcp_proxy.hpp"
#include "tests/unit/capture/support.hpp"

namespace embody::capture {
namespace {

using test::bytes;
using test::eventually;

struct Rig {
  Rig() {
    auto listening = transport::tcp_listen("127.0.0.1", 0);
    EXPECT_TRUE(listening.ok());
    listener = std::move(*listening);
    device_port = transport::local_port(listener.get());
    const Status added = proxy.forward("localhost", device_port);
    EXPECT_TRUE(added.ok()) << added.error().detail.view();
    proxy.start();
  }
  /// A connection through the proxy: the driver's end and the device's.
  void connect() {
    auto fd = transport::tcp_connect("127.0.0.1", proxy.port_for(device_port), deadline());
    ASSERT_TRUE(fd.ok());
    host = std::move(*fd);
    ASSERT_TRUE(eventually([&] { return static_cast<bool>(device = transport::tcp_accept(listener.get())); }));
  }
  static TimePoint deadline() { return transport::now() + std::chrono::seconds(10); }
  static void reset(transport::UniqueFd& fd) {
    const linger now{1, 0};
    ::setsockopt(fd.get(), SOL_SOCKET, SO_LINGER, &now, sizeof now);
    fd.reset();
  }
  static bool is_reset(int fd) {
    std::byte byte{};
    return transport::wait_readable(fd, deadline()) && ::recv(fd, &byte, 1, MSG_DONTWAIT) < 0 && errno == ECONNRESET;
  }

  test::Recording recording;
  transport::UniqueFd listener;
  std::uint16_t device_port{0};
  TcpProxy proxy{*recording.writer};
  transport::UniqueFd host, device;
};

TEST(TcpProxy, PassesLotsOfRandomBytesBothWaysWhoeverIsSlow) {
  Rig rig;
  rig.connect();
  constexpr std::size_t kSize = 3'000'000;
  test::Bytes up(kSize), down(kSize);
  std::mt19937 random(21);
  for (auto* side : {&up, &down}) {
    for (auto& byte : *side) byte = static_cast<std::byte>(random());
  }
  std::thread host_sends([&] { EXPECT_TRUE(transport::send_all(rig.host.get(), up, Rig::deadline()).ok()); });
  std::thread device_sends([&] { EXPECT_TRUE(transport::send_all(rig.device.get(), down, Rig::deadline()).ok()); });
  EXPECT_EQ(test::receive_bytes(rig.device.get(), kSize), up);
  EXPECT_EQ(test::receive_bytes(rig.host.get(), kSize), down);
  host_sends.join();
  device_sends.join();
  const Capture capture = rig.recording.finish();
  EXPECT_EQ(test::bytes_of(capture, 1, Event::kOut), up);
  EXPECT_EQ(test::bytes_of(capture, 1, Event::kIn), down);
}

TEST(TcpProxy, PassesOnAHalfCloseAndGoesOnTheOtherWay) {
  Rig rig;
  rig.connect();
  ASSERT_EQ(transport::send_message(rig.host.get(), bytes("question")), IoStatus::kDone);
  ::shutdown(rig.host.get(), SHUT_WR);
  EXPECT_EQ(test::receive_bytes(rig.device.get(), 100), bytes("question"));  // and the end
  ASSERT_EQ(transport::send_message(rig.device.get(), bytes("answer")), IoStatus::kDone);
  rig.device.reset();
  EXPECT_EQ(test::receive_bytes(rig.host.get(), 100), bytes("answer"));
  const Capture capture = rig.recording.finish();
  ASSERT_EQ(capture.chunks.size(), 5u);
  EXPECT_EQ(capture.chunks[0].port, rig.device_port);
  EXPECT_EQ(capture.chunks[2].event, Event::kClose);
  EXPECT_EQ(capture.chunks[2].by, End::kHost);
  EXPECT_EQ(capture.chunks[4].by, End::kDevice);
  EXPECT_FALSE(capture.chunks[4].reset);
}

TEST(TcpProxy, PassesOnAResetOfEitherEnd) {
  for (const End end : {End::kHost, End::kDevice}) {
    Rig rig;
    rig.connect();
    ASSERT_EQ(transport::send_message(rig.host.get(), bytes("hello")), IoStatus::kDone);
    ASSERT_EQ(test::receive_bytes(rig.device.get(), 5).size(), 5u);
    Rig::reset(end == End::kHost ? rig.host : rig.device);
    EXPECT_TRUE(Rig::is_reset(end == End::kHost ? rig.device.get() : rig.host.get()));
    const Capture capture = rig.recording.finish();
    EXPECT_EQ(capture.chunks.back().event, Event::kClose);
    EXPECT_EQ(capture.chunks.back().by, end);
    EXPECT_TRUE(capture.chunks.back().reset);
  }
}

TEST(TcpProxy, ADeviceThatRefusesIsAReset) {
  Rig rig;
  rig.listener.reset();
  auto host = transport::tcp_connect("127.0.0.1", rig.proxy.port_for(rig.device_port), Rig::deadline());
  ASSERT_TRUE(host.ok());
  EXPECT_TRUE(Rig::is_reset(host->get()));
  const Capture capture = rig.recording.finish();
  ASSERT_EQ(capture.chunks.size(), 2u);
  EXPECT_EQ(capture.chunks[1].by, End::kDevice);
}

TEST(TcpProxy, SeveralConnectionsAndPortsAreKeptApart) {
  test::Recording recording;
  std::vector<transport::UniqueFd> listeners, hosts, devices;
  TcpProxy proxy(*recording.writer);
  for (int i = 0; i < 2; ++i) {
    listeners.push_back(std::move(*transport::tcp_listen("127.0.0.1", 0)));
    ASSERT_TRUE(proxy.forward("127.0.0.1", transport::local_port(listeners.back().get())).ok());
  }
  proxy.start();
  for (int i = 0; i < 6; ++i) {
    const int listener = listeners[static_cast<std::size_t>(i % 2)].get();
    auto fd = transport::tcp_connect("127.0.0.1", proxy.port_for(transport::local_port(listener)), Rig::deadline());
    ASSERT_TRUE(fd.ok());
    hosts.push_back(std::move(*fd));
    ASSERT_TRUE(eventually([&] {
      devices.push_back(transport::tcp_accept(listener));
      if (!devices.back()) devices.pop_back();
      return devices.size() == hosts.size();
    }));
    const std::string text = "connection " + std::to_string(i);
    ASSERT_EQ(transport::send_message(devices.back().get(), bytes(text)), IoStatus::kDone);
    EXPECT_EQ(test::receive_bytes(hosts.back().get(), text.size()), bytes(text));
  }
  proxy.stop();
  for (const auto& host : hosts) EXPECT_EQ(test::receive_bytes(host.get(), 1).size(), 0u);  // closed
  const Capture capture = recording.finish();
  for (std::uint32_t c = 1; c <= 6; ++c) {
    EXPECT_EQ(test::bytes_of(capture, c, Event::kIn), bytes("connection " + std::to_string(c - 1)));
  }
}

TEST(TcpProxy, SaysWhatItCannotForward) {
  const test::Recording recording;
  TcpProxy proxy(*recording.writer);
  EXPECT_EQ(proxy.forward("no-such-host.invalid", 1).error().code, Errc::kNotFound);
  EXPECT_EQ(proxy.forward("127.0.0.1", 1, "nonsense").error().code, Errc::kInvalidArgument);
  EXPECT_EQ(proxy.port_for(1), 0);
}

}  // namespace
}  // namespace embody::capture
