#include "drivers/transport/tty.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <termios.h>

#include <array>
#include <fstream>

#include "drivers/mia/mia_hand.hpp"
#include "drivers/sim/mia/mia_simulator.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/pty.hpp"

namespace embody::test {
namespace {

using std::chrono::seconds;

std::string temporary(const char* name) {
  return ::testing::TempDir() + "embody_tty_" + std::to_string(::getpid()) + "_" + name;
}

TEST(Tty, CarriesAllByteValuesUnchangedInBothDirections) {
  auto pty = transport::open_pty();
  ASSERT_TRUE(pty.ok());
  auto host = transport::open_tty(pty->device);
  ASSERT_TRUE(host.ok()) << host.error().detail.view();
  std::array<std::byte, 256> sent;
  for (std::size_t i = 0; i < sent.size(); ++i) sent[i] = static_cast<std::byte>(i);
  const auto carried = [&sent](int from, int to) {
    EXPECT_EQ(transport::write_tty(from, sent), IoStatus::kDone);
    std::array<std::byte, 512> buffer;
    std::size_t size = 0;
    while (size < sent.size() && transport::wait_readable(to, transport::now() + seconds(5))) {
      const auto got = transport::read_tty(to, std::span(buffer).subspan(size));
      if (got.status != IoStatus::kDone) break;
      size += got.size;
    }
    return size == sent.size() && std::equal(sent.begin(), sent.end(), buffer.begin());
  };
  EXPECT_TRUE(carried(host->fd.get(), pty->master.get()));
  EXPECT_TRUE(carried(pty->master.get(), host->fd.get()));
  std::array<std::byte, 8> buffer;
  EXPECT_EQ(transport::read_tty(host->fd.get(), buffer).status, IoStatus::kEmpty);
  EXPECT_EQ(transport::read_tty(pty->master.get(), buffer).status, IoStatus::kEmpty) << "no echo";
  EXPECT_FALSE(host->low_latency) << "a pseudo-terminal has no such flag, and that is no error";
}

TEST(Tty, IsSetTo115200BaudEightDataBitsNoParityOneStopBitNoFlowControl) {
  auto pty = transport::open_pty();
  ASSERT_TRUE(pty.ok());
  auto host = transport::open_tty(pty->device);
  ASSERT_TRUE(host.ok());
  termios settings{};
  ASSERT_EQ(::tcgetattr(host->fd.get(), &settings), 0);
  EXPECT_EQ(::cfgetispeed(&settings), speed_t{B115200});
  EXPECT_EQ(::cfgetospeed(&settings), speed_t{B115200});
  EXPECT_EQ(settings.c_cflag & (CSIZE | CSTOPB | PARENB | CRTSCTS), tcflag_t{CS8});
  EXPECT_EQ(settings.c_iflag & (IXON | IXOFF | ICRNL | INLCR), tcflag_t{0});
  EXPECT_EQ(settings.c_lflag & (ICANON | ECHO | ISIG), tcflag_t{0});
}

TEST(Tty, HasOneOwnerAtATime) {
  auto pty = transport::open_pty();
  ASSERT_TRUE(pty.ok());
  {
    auto first = transport::open_tty(pty->device);
    ASSERT_TRUE(first.ok());
    auto second = transport::open_tty(pty->device);
    ASSERT_FALSE(second.ok());
    EXPECT_EQ(second.error().code, Errc::kRefused);
    EXPECT_NE(second.error().detail.view().find("busy"), std::string_view::npos);
  }
  EXPECT_TRUE(transport::open_tty(pty->device).ok()) << "free again";
}

TEST(Tty, SaysWhatIsWrongWithADeviceName) {
  auto missing = transport::open_tty("/dev/ttyUSB_not_there");
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, Errc::kNotFound);
  const std::string file = temporary("file");
  std::ofstream(file) << "text";
  auto regular = transport::open_tty(file);
  ASSERT_FALSE(regular.ok());
  EXPECT_EQ(regular.error().code, Errc::kInvalidArgument);
  ::unlink(file.c_str());
}

TEST(Tty, NamesTheDialoutGroupWhenItMayNotBeOpened) {
  auto pty = transport::open_pty();
  ASSERT_TRUE(pty.ok());
  ASSERT_EQ(::chmod(pty->device.c_str(), 0), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {  // root may open anything: try as nobody
    if (::geteuid() == 0 && ::setuid(65534) != 0) ::_exit(2);
    const auto refused = transport::open_tty(pty->device);
    const bool right = !refused.ok() && refused.error().code == Errc::kPermission &&
                       refused.error().detail.view().find("dialout") != std::string_view::npos;
    ::_exit(right ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(Tty, HangUpReadsAsTheEndOfTheSession) {
  auto pty = transport::open_pty();
  ASSERT_TRUE(pty.ok());
  auto host = transport::open_tty(pty->device);
  ASSERT_TRUE(host.ok());
  pty->master.reset();
  std::array<std::byte, 8> buffer{};
  EXPECT_EQ(transport::read_tty(host->fd.get(), buffer).status, IoStatus::kDisconnected);
  EXPECT_EQ(transport::write_tty(host->fd.get(), buffer), IoStatus::kDisconnected);
}

TEST(MiaSimulator, RefusesToReplaceAFileByItsLinkAndRemovesOnlyItsOwn) {
  const std::string link = temporary("link");
  std::ofstream(link) << "precious";
  sim::MiaSimulatorConfig config;
  config.link = link;
  sim::MiaSimulator simulator(config);
  const Status refused = simulator.start();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, Errc::kRefused);
  EXPECT_EQ(simulator.device(), "");
  ::unlink(link.c_str());

  ASSERT_EQ(::symlink("/nowhere", link.c_str()), 0);
  ASSERT_TRUE(simulator.start().ok()) << "an old symlink is replaced";
  EXPECT_TRUE(transport::open_tty(link).ok());
  simulator.stop();
  EXPECT_NE(::access(link.c_str(), F_OK), 0);

  ASSERT_TRUE(simulator.start().ok());
  ::unlink(link.c_str());
  ASSERT_EQ(::symlink("/dev/null", link.c_str()), 0);  // somebody else's by now
  simulator.stop();
  EXPECT_EQ(::access(link.c_str(), F_OK), 0);
  ::unlink(link.c_str());
}

TEST(MiaSimulator, ServesOneHostAfterAnother) {
  sim::MiaSimulator simulator({});
  ASSERT_TRUE(simulator.start().ok());
  mia::MiaConfig config;
  config.device = simulator.device();
  for (int i = 0; i < 5; ++i) {
    mia::MiaHand hand(config);
    const auto info = hand.connect();
    ASSERT_TRUE(info.ok()) << "host " << i << ": " << info.error().detail.view();
  }
  EXPECT_EQ(simulator.counters().stops, 5u) << "each host stops the hand when it leaves";
}

}  // namespace
}  // namespace embody::test
