#include "core/hand/confidence.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/math/random_values.hpp"

namespace embody::hand {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// From the best to the worst.
constexpr std::array<FingerQuality, 6> kQualities{FingerQuality::kOptimal, FingerQuality::kAtLimit,
                                                  FingerQuality::kCapped,  FingerQuality::kHeld,
                                                  FingerQuality::kLost,    FingerQuality::kNone};

FingerEvidence random_evidence(test::RandomValues& random) {
  FingerEvidence evidence;
  evidence.markers = static_cast<std::size_t>(random(1.0, 9.0));
  evidence.usable = static_cast<std::size_t>(random(0.0, static_cast<double>(evidence.markers) + 1.0));
  evidence.unseen = from_seconds(random(0.0, 1.0));
  evidence.residual_m = random(0.0, .02);
  evidence.quality = kQualities[static_cast<std::size_t>(random(0.0, 5.0))];
  return evidence;
}

TEST(FingerConfidence, IsOneOnlyWhenEverythingIsSeenAndExplained) {
  EXPECT_EQ(finger_confidence({2, 2, Duration{0}, 0.0, FingerQuality::kOptimal}), 1.0);
  EXPECT_EQ(finger_confidence({}), 0.0);
  EXPECT_EQ(finger_confidence({0, 0, Duration{0}, 0.0, FingerQuality::kOptimal}), 0.0);
  for (const double residual_m : {kNan, kInfinity, -kInfinity}) {
    EXPECT_EQ(finger_confidence({2, 2, Duration{0}, residual_m, FingerQuality::kOptimal}), 0.0);
  }
}

TEST(FingerConfidence, StaysBetweenZeroAndOneAndNeverGrowsWhenAnythingGetsWorse) {
  test::RandomValues random(111);
  for (int i = 0; i < 20'000; ++i) {
    const FingerEvidence evidence = random_evidence(random);
    const double confidence = finger_confidence(evidence);
    ASSERT_GE(confidence, 0.0);
    ASSERT_LE(confidence, 1.0);
    FingerEvidence worse = evidence;
    if (worse.usable > 0) --worse.usable;
    ASSERT_LE(finger_confidence(worse), confidence) << "fewer markers";
    worse = evidence;
    worse.unseen += from_seconds(random(0.0, 1.0));
    ASSERT_LE(finger_confidence(worse), confidence) << "longer unseen";
    worse = evidence;
    worse.residual_m += random(0.0, .01);
    ASSERT_LE(finger_confidence(worse), confidence) << "greater residual";
  }
  for (std::size_t i = 1; i < kQualities.size(); ++i) {
    EXPECT_LE(finger_confidence({2, 2, Duration{0}, 0.0, kQualities[i]}),
              finger_confidence({2, 2, Duration{0}, 0.0, kQualities[i - 1]}));
  }
}

TEST(HandConfidence, IsTheLeastOfTheBackOfTheHandAndTheFingersThatCarryMarkers) {
  test::RandomValues random(112);
  for (int i = 0; i < 2'000; ++i) {
    std::array<double, kFingers> fingers{};
    std::array<bool, kFingers> carries{};
    double least = 1.0;
    for (std::size_t f = 0; f < kFingers; ++f) {
      fingers[f] = random(0.0, 1.0);
      carries[f] = random(0.0, 1.0) < 0.7;
      if (carries[f]) least = std::min(least, fingers[f]);
    }
    EXPECT_EQ(hand_confidence(true, 0.0, fingers, carries), least);
    EXPECT_EQ(hand_confidence(false, 0.0, fingers, carries), 0.0);
    const double error_m = random(0.0, .004);
    const double confidence = hand_confidence(true, error_m, fingers, carries);
    EXPECT_LE(confidence, least);
    EXPECT_LE(hand_confidence(true, error_m + .001, fingers, carries), confidence);
  }
  EXPECT_EQ(hand_confidence(true, kNan, {1, 1, 1, 1, 1}, {}), 0.0);
  EXPECT_NEAR(hand_confidence(true, .002, {1, 1, 1, 1, 1}, {}), 0.5, 1e-12);
}

}  // namespace
}  // namespace embody::hand
