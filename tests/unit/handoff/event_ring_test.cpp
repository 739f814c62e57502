#include "daemon/handoff/event_ring.hpp"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <thread>

namespace embody {
namespace {

TEST(EventRing, KeepsTheOrderAndDropsTheNewestWhenItIsFull) {
  EventRing<int, 8> ring;
  int value = -1;
  EXPECT_FALSE(ring.pop(value));
  for (int round = 0; round < 100; ++round) {
    for (int i = 0; i < 8; ++i) ASSERT_TRUE(ring.push(10 * round + i));
    ASSERT_FALSE(ring.push(-1));
    ASSERT_EQ(ring.dropped(), static_cast<std::uint64_t>(round + 1));
    for (int i = 0; i < 8; ++i) {
      ASSERT_TRUE(ring.pop(value));
      ASSERT_EQ(value, 10 * round + i);
    }
    ASSERT_FALSE(ring.pop(value));
  }
}

TEST(EventRing, LosesNothingButWhatItCountsBetweenTwoThreads) {
  constexpr std::uint64_t kValues = 1'000'000;
  struct Pair {
    std::uint64_t a{0}, b{0};
  };
  EventRing<Pair, 64> ring;
  std::atomic<bool> finished{false};
  std::uint64_t refused = 0;
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= kValues; ++i) {
      if (!ring.push({i, ~i})) ++refused;
    }
    finished.store(true, std::memory_order_release);
  });
  std::uint64_t taken = 0;
  std::uint64_t last = 0;
  std::uint64_t wrong = 0;
  while (true) {
    const bool last_look = finished.load(std::memory_order_acquire);
    Pair pair;
    while (ring.pop(pair)) {
      ++taken;
      if (pair.b != ~pair.a || pair.a <= last) ++wrong;
      last = pair.a;
    }
    if (last_look) break;
    std::this_thread::yield();
  }
  writer.join();
  EXPECT_EQ(wrong, 0U) << "torn or out of order";
  EXPECT_EQ(refused, ring.dropped());
  EXPECT_EQ(taken + ring.dropped(), kValues);
  EXPECT_GT(taken, 0U);
}

}  // namespace
}  // namespace embody
