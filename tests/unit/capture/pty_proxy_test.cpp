// The serial proxy between two pseudo-terminals.
#include "drivers/capture/pty_proxy.hpp"

#include "drivers/transport/tty.hpp"
#include "tests/unit/capture/support.hpp"

namespace embody::capture {
namespace {

using test::bytes;
using test::eventually;

struct Rig {
  Rig() {
    auto line = transport::open_pty();
    EXPECT_TRUE(line.ok());
    device = std::move(*line);
    const Status opened = proxy.open(device.device);
    EXPECT_TRUE(opened.ok()) << opened.error().detail.view();
  }
  void open_host() {
    auto tty = transport::open_tty(proxy.device());
    ASSERT_TRUE(tty.ok()) << tty.error().detail.view();
    host = std::move(tty->fd);
  }
  static std::string read_all(int fd, std::size_t size) {
    std::string text;
    std::array<std::byte, 512> buffer;
    const bool complete = eventually([&] {
      const auto received = transport::read_tty(fd, buffer);
      text.append(reinterpret_cast<const char*>(buffer.data()), received.size);
      return text.size() >= size || received.status == IoStatus::kDisconnected;
    });
    EXPECT_TRUE(complete);
    return text;
  }
  static void write(int fd, std::string_view text) {
    ASSERT_EQ(transport::write_tty(fd, std::as_bytes(std::span(text))), IoStatus::kDone);
  }

  test::Recording recording{LinkKind::kSerial};
  transport::Pty device;
  PtyProxy proxy{*recording.writer};
  transport::UniqueFd host;
};

TEST(PtyProxy, CopiesEveryByteValueBothWaysUnchanged) {
  Rig rig;
  rig.open_host();
  std::string all;
  for (int i = 0; i < 256; ++i) all += static_cast<char>(i);
  Rig::write(rig.host.get(), all);
  EXPECT_EQ(Rig::read_all(rig.device.master.get(), 256), all);
  Rig::write(rig.device.master.get(), all);
  EXPECT_EQ(Rig::read_all(rig.host.get(), 256), all);
  const Capture capture = rig.recording.finish();
  EXPECT_EQ(test::bytes_of(capture, 1, Event::kOut), bytes(all));
  EXPECT_EQ(test::bytes_of(capture, 1, Event::kIn), bytes(all));
}

TEST(PtyProxy, EachOpeningIsAConnection) {
  Rig rig;
  const auto closes = [&rig] {
    const auto capture = load_capture(rig.recording.path);
    if (!capture) return std::ptrdiff_t{0};
    return std::count_if(capture->chunks.begin(), capture->chunks.end(),
                         [](const Chunk& chunk) { return chunk.event == Event::kClose; });
  };
  for (int i = 1; i <= 3; ++i) {
    rig.open_host();
    const std::string text = "opening " + std::to_string(i);
    Rig::write(rig.host.get(), text);
    EXPECT_EQ(Rig::read_all(rig.device.master.get(), text.size()), text);
    rig.host.reset();
    ASSERT_TRUE(eventually([&] { return closes() == i; }));
  }
  const Capture capture = rig.recording.finish();
  ASSERT_EQ(capture.chunks.size(), 9u);
  for (std::uint32_t i = 1; i <= 3; ++i) {
    EXPECT_EQ(test::bytes_of(capture, i, Event::kOut), bytes("opening " + std::to_string(i)));
  }
}

TEST(PtyProxy, AnUnpluggedLineHangsUpOnTheDriver) {
  Rig rig;
  rig.open_host();
  Rig::write(rig.host.get(), "x");
  EXPECT_EQ(Rig::read_all(rig.device.master.get(), 1), "x");
  rig.device.master.reset();
  ASSERT_TRUE(eventually([&] { return rig.proxy.over(); }));
  std::array<std::byte, 8> buffer;
  EXPECT_TRUE(
      eventually([&] { return transport::read_tty(rig.host.get(), buffer).status == IoStatus::kDisconnected; }));
  const Capture capture = rig.recording.finish();
  EXPECT_EQ(capture.chunks.back().event, Event::kClose);
  EXPECT_EQ(capture.chunks.back().by, End::kDevice);
}

TEST(PtyProxy, OwnsTheLineAndSaysWhenItCannot) {
  Rig rig;
  EXPECT_FALSE(transport::open_tty(rig.device.device).ok());
  PtyProxy second(*rig.recording.writer);
  EXPECT_EQ(second.open(rig.device.device).error().code, Errc::kRefused);
  EXPECT_EQ(second.open("/dev/no-such-line").error().code, Errc::kNotFound);
}

}  // namespace
}  // namespace embody::capture
