#include "daemon/handoff/wake.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <array>
#include <thread>

namespace embody {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(Wake, StaysAwakeUntilItIsCleared) {
  Wake wake;
  EXPECT_FALSE(wait_for_input(wake.fd(), -1, Duration{0}));
  for (int i = 0; i < 3; ++i) wake.notify();
  EXPECT_TRUE(wait_for_input(wake.fd(), -1, seconds(5)));
  EXPECT_TRUE(wait_for_input(wake.fd(), -1, seconds(5))) << "looking does not clear";
  wake.clear();
  EXPECT_FALSE(wait_for_input(wake.fd(), -1, Duration{0})) << "one clear takes all notifications";
  wake.clear();  // does not block
}

TEST(Wake, NeverBlocksTheThreadThatNotifies) {
  Wake wake;
  const std::uint64_t nearly_full = ~std::uint64_t{0} - 1;
  ASSERT_EQ(::write(wake.fd(), &nearly_full, sizeof nearly_full), static_cast<ssize_t>(sizeof nearly_full));
  wake.notify();  // the counter is full: must return all the same
  EXPECT_TRUE(wait_for_input(wake.fd(), -1, seconds(5)));
}

TEST(Wake, WakesAThreadThatWaits) {
  Wake wake;
  std::thread notifier([&] { wake.notify(); });
  bool woken = false;
  const auto deadline = std::chrono::steady_clock::now() + seconds(10);
  while (!woken && std::chrono::steady_clock::now() < deadline) woken = wait_for_input(wake.fd(), -1, seconds(10));
  notifier.join();
  EXPECT_TRUE(woken);
}

TEST(WaitForInput, TellsWhichDescriptorIsReadyAndSkipsMissingOnes) {
  Wake first;
  Wake second;
  second.notify();
  EXPECT_FALSE(wait_for_input(first.fd(), second.fd(), seconds(5))) << "woken, but not by the first one";
  first.notify();
  EXPECT_TRUE(wait_for_input(first.fd(), second.fd(), seconds(5)));
  EXPECT_FALSE(wait_for_input(-1, -1, Duration{1}));
  EXPECT_FALSE(wait_for_input(-1, -1, -milliseconds(5))) << "a deadline that has passed does not wait";
}

TEST(WaitForInput, ReturnsForAPeerThatHungUp) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()), 0);
  ::close(ends[1]);
  EXPECT_TRUE(wait_for_input(ends[0], -1, seconds(5)));
  ::close(ends[0]);
}

}  // namespace
}  // namespace embody
