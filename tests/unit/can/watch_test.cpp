#include <gtest/gtest.h>

#include "drivers/mia/compact/state_watch.hpp"
#include "drivers/mia/compact/stop_sequence.hpp"

namespace embody::mia::compact {
namespace {

using std::chrono::milliseconds;
constexpr TimePoint kStart{std::chrono::seconds(100)};

State state(int counter, int counts = 0) {
  return {static_cast<std::int16_t>(counts), 0, 0, kCalibrated, static_cast<std::uint8_t>(counter)};
}

TEST(StateWatch, ASetIsOneNewStateOfEachMotorAndAsOldAsItsOldest) {
  StateWatch watch;
  watch.reset(kStart);
  watch.take(0, state(1, 10), kStart + milliseconds(1));
  watch.take(0, state(2, 11), kStart + milliseconds(2));
  watch.take(1, state(1, 20), kStart + milliseconds(3));
  EXPECT_FALSE(watch.complete());
  watch.take(2, state(1, 30), kStart + milliseconds(4));
  ASSERT_TRUE(watch.complete());
  EXPECT_EQ(watch.counts(), (std::array<double, kMotors>{11.0, 20.0, 30.0}));
  EXPECT_EQ(watch.take_set(), kStart + milliseconds(2));
  EXPECT_FALSE(watch.complete());
}

TEST(StateWatch, CountsGapsAcrossTheWrapOfTheCounter) {
  StateWatch watch;
  watch.reset(kStart);
  for (const int counter : {254, 255, 0, 3}) watch.take(1, state(counter), kStart);
  EXPECT_EQ(watch.lost(), 2u);
  EXPECT_EQ(watch.repeated(), 0u);
}

TEST(StateWatch, ACounterThatStandsStillIsSilence) {
  StateWatch watch;
  watch.reset(kStart);
  for (int ms = 0; ms <= 120; ms += 10) {
    const TimePoint t = kStart + milliseconds(ms);
    watch.take(0, state(ms / 10), t);
    watch.take(1, state(7, ms), t);
    watch.take(2, state(ms / 10), t);
  }
  EXPECT_EQ(watch.silent(kStart + milliseconds(120), milliseconds(100)), std::optional<std::size_t>(1));
  EXPECT_EQ(watch.repeated(), 12u);
  EXPECT_EQ(watch.state(1).counts, 0) << "old news is not taken";
}

TEST(StopSequence, TriesFourTimesThenEachMotorAndOpensOnlyAfterAHold) {
  StopSequence stop;
  EXPECT_TRUE(stop.may_resume());
  EXPECT_TRUE(stop.request());
  EXPECT_FALSE(stop.request()) << "under way";
  for (int i = 0; i < 4; ++i) {
    ASSERT_TRUE(stop.busy());
    EXPECT_EQ(stop.target(), kAllMotors);
    stop.finish(false);
  }
  for (std::uint8_t motor = 0; motor < kMotors; ++motor) {
    ASSERT_TRUE(stop.busy());
    EXPECT_EQ(stop.target(), motor);
    stop.hold();
    EXPECT_FALSE(stop.may_resume()) << "not before it is over";
    stop.finish(true);
  }
  EXPECT_FALSE(stop.busy());
  EXPECT_TRUE(stop.acknowledged());
  EXPECT_TRUE(stop.may_resume());
  EXPECT_FALSE(stop.request()) << "said and heard; but it closes the latch again";
  EXPECT_FALSE(stop.may_resume());
}

TEST(StopSequence, WhatWasNeverAcknowledgedBeginsAgain) {
  StopSequence stop;
  stop.request();
  for (int i = 0; i < 7; ++i) stop.finish(false);
  EXPECT_FALSE(stop.busy());
  EXPECT_FALSE(stop.acknowledged());
  EXPECT_TRUE(stop.latched());
  EXPECT_TRUE(stop.request());
}

}  // namespace
}  // namespace embody::mia::compact
