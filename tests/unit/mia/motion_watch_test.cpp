// What a hand can have done since its last reading, and what it cannot.
#include "drivers/mia/motion_watch.hpp"

#include <gtest/gtest.h>

#include <random>

#include "drivers/sim/mia/motor.hpp"

namespace embody::mia {
namespace {

using Verdict = MotionWatch::Verdict;
using Counts = std::array<double, kMotors>;
using std::chrono::milliseconds;

constexpr TimePoint kStart{std::chrono::seconds(100)};

TEST(MiaMotionWatch, BelievesEverythingThatAHandDoesWhateverItIsTold) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> any_counts(-255, 255), any_choice(0, 9), any_pause(1, 25);
  for (int run = 0; run < 200; ++run) {
    const int speed_percent = 10 + 89 * (run % 2);
    MotionWatch watch(speed_percent);
    std::array<sim::MiaMotor, kMotors> motors;
    Counts counts{};
    for (std::size_t i = 0; i < kMotors; ++i) {
      counts[i] = i == 1 ? any_counts(random) : std::abs(any_counts(random));
      motors[i] = sim::MiaMotor(static_cast<Motor>(i), counts[i], 0.04);
    }
    TimePoint now = kStart;
    EXPECT_FALSE(watch.begin(counts, now)) << "nothing is known of an earlier session";
    for (int step = 0; step < 300; ++step) {
      const auto motor = static_cast<std::size_t>(step % 3);
      if (any_choice(random) < 3) {
        const int target = motor == 1 ? any_counts(random) : std::abs(any_counts(random));
        motors[motor].move_to(target, speed_percent);
        watch.told(motor, target);
      } else if (any_choice(random) == 0) {
        for (sim::MiaMotor& each : motors) each.halt();
        watch.told_to_stop();
      }
      const Duration pause = milliseconds(5 * any_pause(random));
      now += pause;
      for (std::size_t i = 0; i < kMotors; ++i) {
        motors[i].advance(to_seconds(pause));
        counts[i] = std::round(motors[i].counter());
      }
      ASSERT_EQ(watch.take(counts, now), Verdict::kPlausible) << "run " << run << ", step " << step;
    }
  }
}

TEST(MiaMotionWatch, BelievesAHandThatIsToldSeveralTargetsBetweenTwoReadings) {
  std::mt19937 random(11);
  std::uniform_int_distribution<int> any_counts(-255, 255), any_way(-25, 25), any_number(0, 3), any_pause(1, 12);
  for (int run = 0; run < 400; ++run) {
    constexpr int kSpeed_percent = 15;
    MotionWatch watch(kSpeed_percent);
    std::array<sim::MiaMotor, kMotors> motors;
    Counts counts{};
    for (std::size_t i = 0; i < kMotors; ++i) motors[i] = sim::MiaMotor(static_cast<Motor>(i), 0.0, 0.04);
    TimePoint now = kStart;
    watch.begin(counts, now);
    for (int step = 0; step < 100; ++step) {
      for (int left = any_number(random); left >= 0; --left) {
        for (std::size_t i = 0; i < kMotors; ++i) {
          // Half of them stay near zero, where a restarted hand would be.
          const int target = run % 2 == 0 ? any_way(random) : any_counts(random);
          const int possible = i == 1 ? target : std::abs(target);
          motors[i].move_to(possible, kSpeed_percent);
          watch.told(i, possible);
        }
        const Duration pause = milliseconds(10 * any_pause(random));
        now += pause;
        for (sim::MiaMotor& motor : motors) motor.advance(to_seconds(pause));
      }
      for (std::size_t i = 0; i < kMotors; ++i) counts[i] = std::round(motors[i].counter());
      ASSERT_EQ(watch.take(counts, now), Verdict::kPlausible) << "run " << run << ", step " << step;
    }
  }
}

TEST(MiaMotionWatch, ThrowsOneBrokenReadingAwayAndTakesTwoForARestart) {
  MotionWatch watch(60);
  const Counts here{100, -120, 60};
  Counts broken = here;
  broken[0] = 900;  // a digit that lost a bit
  watch.begin(here, kStart);
  EXPECT_EQ(watch.take(broken, kStart + milliseconds(50)), Verdict::kImplausible);
  EXPECT_EQ(watch.take(here, kStart + milliseconds(100)), Verdict::kPlausible);
  EXPECT_EQ(watch.take({0, 0, 0}, kStart + milliseconds(150)), Verdict::kImplausible);
  EXPECT_EQ(watch.take({0, 0, 0}, kStart + milliseconds(200)), Verdict::kRestarted);
}

TEST(MiaMotionWatch, TwoReadingsBrokenInDifferentWaysAreNoRestart) {
  MotionWatch watch(60);
  const Counts here{100, -120, 60};
  watch.begin(here, kStart);
  EXPECT_EQ(watch.take({900, -120, 60}, kStart + milliseconds(50)), Verdict::kImplausible);
  EXPECT_EQ(watch.take({100, 420, 60}, kStart + milliseconds(100)), Verdict::kImplausible);
  EXPECT_EQ(watch.take(here, kStart + milliseconds(150)), Verdict::kPlausible);
}

TEST(MiaMotionWatch, FindsZeroedCountersHoweverNearAndHoweverLate) {
  for (const double where : {12.0, 30.0, 200.0}) {
    MotionWatch watch(99);
    watch.begin({where, 0, 0}, kStart);
    for (int i = 1; i <= 10; ++i)
      ASSERT_EQ(watch.take({where, 0, 0}, kStart + i * milliseconds(50)), Verdict::kPlausible);
    const TimePoint later = kStart + std::chrono::seconds(3);  // the hand was silent meanwhile
    EXPECT_EQ(watch.take({0, 0, 0}, later), Verdict::kImplausible) << where;
    EXPECT_EQ(watch.take({0, 0, 0}, later + milliseconds(50)), Verdict::kRestarted) << where;
  }
}

TEST(MiaMotionWatch, ZeroIsNoRestartWhereTheHandWasSentThere) {
  MotionWatch watch(60);
  watch.begin({50, 0, 40}, kStart);
  watch.told(0, 0.0);
  watch.told(2, 0.0);
  EXPECT_EQ(watch.take({0, 0, 0}, kStart + milliseconds(500)), Verdict::kPlausible);
}

TEST(MiaMotionWatch, ANewSessionTellsAZeroedHandFromOneThatWasMovedByOthers) {
  MotionWatch watch(60);
  watch.begin({100, -50, 40}, kStart);
  watch.told_to_stop();
  EXPECT_FALSE(watch.begin({3, 80, 200}, kStart + std::chrono::seconds(9)));
  watch.told(0, 0.0);
  watch.told(1, 0.0);
  watch.told(2, 0.0);
  EXPECT_FALSE(watch.begin({0, 0, 0}, kStart + std::chrono::seconds(12))) << "it was on its way there";
  watch.begin({100, -50, 40}, kStart + std::chrono::seconds(13));
  watch.told_to_stop();
  EXPECT_TRUE(watch.begin({0, 0, 0}, kStart + std::chrono::seconds(15)));
}

TEST(MiaMotionWatch, TellsStandingFromMoving) {
  MotionWatch watch(60);
  watch.begin({50, 0, 40}, kStart);
  TimePoint now = kStart;
  for (int i = 0; i < 10; ++i) {
    now += milliseconds(50);
    ASSERT_EQ(watch.take({50.0 + 2 * i, 0, 40}, now), Verdict::kPlausible);
    EXPECT_FALSE(watch.still());
  }
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(watch.still(), i >= 3);
    now += milliseconds(50);
    ASSERT_EQ(watch.take({68, 0, 40}, now), Verdict::kPlausible);
  }
  EXPECT_TRUE(watch.still());
}

}  // namespace
}  // namespace embody::mia
