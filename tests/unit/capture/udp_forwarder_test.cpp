#include "drivers/capture/udp_forwarder.hpp"

#include "drivers/transport/udp.hpp"
#include "tests/unit/capture/support.hpp"

namespace embody::capture {
namespace {

TEST(UdpForwarder, PassesEveryDatagramOnWithItsBoundaries) {
  test::Recording recording(LinkKind::kUdp);
  auto driver = transport::udp_bind("127.0.0.1", 0, 1 << 20);
  ASSERT_TRUE(driver.ok());
  UdpForwarder forwarder(*recording.writer);
  ASSERT_TRUE(forwarder.open("127.0.0.1", 0, transport::local_port(driver->get())).ok());
  auto sensor = transport::udp_connect("127.0.0.1", forwarder.port());
  ASSERT_TRUE(sensor.ok());
  std::vector<std::byte> buffer(65'536);
  const std::array<std::size_t, 5> sizes{1, 360, 0, 9000, 60'000};
  for (const std::size_t size : sizes) {
    const test::Bytes sent(size, std::byte{0x5a});
    ASSERT_EQ(transport::send_message(sensor->get(), sent), IoStatus::kDone);
    ASSERT_TRUE(transport::wait_readable(driver->get(), transport::now() + std::chrono::seconds(10)));
    const auto got = transport::receive_datagram(driver->get(), buffer);
    EXPECT_EQ(got.size, size);
  }
  forwarder.stop();
  const Capture capture = recording.finish();
  ASSERT_EQ(capture.chunks.size(), 1 + sizes.size());
  for (std::size_t i = 0; i < sizes.size(); ++i) EXPECT_EQ(capture.chunks[i + 1].bytes.size(), sizes[i]);
}

TEST(UdpForwarder, GoesOnWhenNoDriverListens) {
  test::Recording recording(LinkKind::kUdp);
  UdpForwarder forwarder(*recording.writer);
  ASSERT_TRUE(forwarder.open("127.0.0.1", 0, 9).ok());
  auto sensor = transport::udp_connect("127.0.0.1", forwarder.port());
  ASSERT_TRUE(sensor.ok());
  for (std::uint64_t i = 1; i <= 5; ++i) {
    ASSERT_EQ(transport::send_message(sensor->get(), test::bytes("frame")), IoStatus::kDone);
    ASSERT_TRUE(test::eventually([&] { return recording.writer->counters().chunks == i; }));
  }
}

}  // namespace
}  // namespace embody::capture
