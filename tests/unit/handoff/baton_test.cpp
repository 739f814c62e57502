#include "daemon/handoff/baton.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace embody {
namespace {

struct Device {
  std::uint64_t uses{0};  // plain: only its owner may touch it
};
struct Session {
  int fd{-1};
  std::uint64_t number{0};
};

TEST(Baton, BelongsToOneSideAtATime) {
  Device device;
  Baton<Device, Session> baton(device);
  EXPECT_TRUE(baton.with_links());
  EXPECT_FALSE(baton.with_loop());
  EXPECT_EQ(baton.fd(), -1);
  baton.pass_to_loop({7, 1});
  EXPECT_FALSE(baton.with_links());
  EXPECT_TRUE(baton.with_loop());
  EXPECT_EQ(baton.fd(), 7);
  EXPECT_EQ(baton.info().number, 1U);
  baton.give_back();
  EXPECT_TRUE(baton.with_links());
  EXPECT_EQ(baton.fd(), -1) << "nobody may touch the descriptor of a session that is over";
}

TEST(Baton, IsRevokedOnce) {
  Device device;
  Baton<Device, Session> baton(device);
  EXPECT_FALSE(baton.take_revoked());
  baton.revoke();
  baton.revoke();
  EXPECT_TRUE(baton.take_revoked());
  EXPECT_FALSE(baton.take_revoked());
}

TEST(Baton, HandsTheDriverAndItsSessionOverBetweenTwoThreads) {
  constexpr std::uint64_t kRounds = 100'000;
  Device device;
  Baton<Device, Session> baton(device);
  std::uint64_t wrong = 0;
  std::thread loop([&] {
    for (std::uint64_t round = 1; round <= kRounds; ++round) {
      while (!baton.with_loop()) std::this_thread::yield();
      if (baton.info().number != round || baton.driver().uses != 2 * round - 1) ++wrong;
      ++baton.driver().uses;
      baton.give_back();
    }
  });
  for (std::uint64_t round = 1; round <= kRounds; ++round) {
    while (!baton.with_links()) std::this_thread::yield();
    ++baton.driver().uses;
    baton.pass_to_loop({static_cast<int>(round), round});
  }
  loop.join();
  EXPECT_EQ(wrong, 0U);
  EXPECT_EQ(device.uses, 2 * kRounds);
}

}  // namespace
}  // namespace embody
