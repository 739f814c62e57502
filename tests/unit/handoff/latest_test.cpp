#include "daemon/handoff/latest.hpp"

#include <gtest/gtest.h>

#include <array>
#include <thread>

namespace embody {
namespace {

/// A value that shows whether it is whole: every word is the same.
struct Wide {
  std::array<std::uint64_t, 64> words{};
  void fill(std::uint64_t value) { words.fill(value); }
  [[nodiscard]] bool whole() const {
    for (const std::uint64_t word : words) {
      if (word != words[0]) return false;
    }
    return true;
  }
};

TEST(Latest, HasNothingNewBeforeTheFirstValueAndTakesEachValueOnce) {
  Latest<int> latest;
  EXPECT_FALSE(latest.update());
  EXPECT_EQ(latest.get(), 0);
  latest.publish(1);
  latest.publish(2);
  EXPECT_EQ(latest.get(), 0) << "get() alone takes nothing";
  EXPECT_TRUE(latest.update());
  EXPECT_EQ(latest.get(), 2) << "the newest wins";
  EXPECT_FALSE(latest.update());
  EXPECT_EQ(latest.get(), 2);
}

TEST(Latest, GivesTheNewestValueForAnyInterleavingOfWritesAndReads) {
  Latest<int> latest;
  unsigned dice = 1;  // a linear congruential generator: the same sequence everywhere
  int written = 0;
  int read = 0;
  for (int i = 0; i < 100'000; ++i) {
    dice = dice * 1664525U + 1013904223U;
    if ((dice >> 30) != 0) {
      latest.publish(++written);
    } else {
      ASSERT_EQ(latest.update(), written != read) << i;
      read = written;
      ASSERT_EQ(latest.get(), written) << i;
    }
  }
}

TEST(Latest, IsNeverTornNorOutOfOrderBetweenTwoThreadsAndTheLastValueArrives) {
  constexpr std::uint64_t kValues = 1'000'000;
  Latest<Wide> latest;
  std::thread writer([&] {
    Wide value;
    for (std::uint64_t i = 1; i <= kValues; ++i) {
      value.fill(i);
      latest.publish(value);
    }
  });
  std::uint64_t last = 0;
  std::uint64_t taken = 0;
  std::uint64_t torn = 0;
  std::uint64_t disordered = 0;
  while (last != kValues) {  // ends only when the newest value has arrived
    if (!latest.update()) {
      std::this_thread::yield();
      continue;
    }
    ++taken;
    if (!latest.get().whole()) ++torn;
    if (latest.get().words[0] <= last) ++disordered;
    last = latest.get().words[0];
    if (disordered != 0) break;
  }
  writer.join();
  EXPECT_EQ(torn, 0U);
  EXPECT_EQ(disordered, 0U);
  EXPECT_GT(taken, 0U);
  EXPECT_FALSE(latest.update());
}

}  // namespace
}  // namespace embody
