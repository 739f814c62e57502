#include "drivers/mia/transmission.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

namespace embody::mia {
namespace {

/// The index map of the vendor's driver: motor counts -> crank angle -> signed flexion, discontinuous at some knots.
double vendor_delta_rad(double counts) {
  struct Piece {
    double upper, slope, offset;
  };
  static constexpr std::array<Piece, 12> kPieces{{{-0.85, -.782149, .439867},
                                                  {-0.60, -1.030584, .227646},
                                                  {-0.28, -1.223688, .111053},
                                                  {-0.09, -1.168471, .126182},
                                                  {0.04, -.911231, .150183},
                                                  {0.17, -.601663, .138772},
                                                  {0.58, -.197881, .071140},
                                                  {0.88, -.520051, .256841},
                                                  {1.16, -.719741, .431658},
                                                  {1.49, -.839379, .569989},
                                                  {1.88, -.942927, .723949},
                                                  {2.20, -1.084425, .989586}}};
  const double alpha = (-8.673 * counts + 580.8284) / 1280.0;
  for (const Piece& piece : kPieces) {
    if (alpha <= piece.upper) return piece.slope * alpha + piece.offset;
  }
  return kPieces.back().slope * alpha + kPieces.back().offset;
}

TEST(MiaTransmission, IndexMapAgreesWithTheVendorsWithinAThousandthOfARadian) {
  const IndexTransmission index;
  for (int counts = -kMaxCounts; counts <= kMaxCounts; ++counts) {
    EXPECT_NEAR(index_delta_rad(index, counts), vendor_delta_rad(counts), 1.0e-3) << counts << " counts";
  }
}

/// The vendor's inverse: signed flexion -> crank angle -> motor counts.
double vendor_counts(double delta_rad) {
  struct Piece {
    double upper, slope, offset;
  };
  static constexpr std::array<Piece, 15> kPieces{{{-1.07, -.917583, .918828},
                                                  {-.70, -1.053913, .773465},
                                                  {-.38, -1.194334, .675796},
                                                  {-.17, -1.431898, .586185},
                                                  {-.05, -1.964169, .496913},
                                                  {-.01, -3.386105, .424335},
                                                  {0.0, -10.977376, .351597},
                                                  {.01, -8.898456, .342954},
                                                  {.05, -2.867630, .283966},
                                                  {.15, -1.477873, .217013},
                                                  {.33, -.974113, .141950},
                                                  {.80, -.813805, .090328},
                                                  {1.16, -.978064, .222664},
                                                  {1.33, -1.239413, .525808},
                                                  {1.5, -1.429410, .778435}}};
  const Piece* piece = &kPieces.back();
  for (const Piece& candidate : kPieces) {
    if (delta_rad > candidate.upper) continue;
    piece = &candidate;
    break;
  }
  return std::round(-0.1153 * 1280.0 * (piece->slope * delta_rad + piece->offset) + 66.9697);
}

TEST(MiaTransmission, SamplesOfTheVendorsIndexMapAgreeInBothDirections) {
  const std::array<std::pair<int, double>, 13> samples{{{-255, -1.376},
                                                        {-200, -.982},
                                                        {-150, -.664},
                                                        {-100, -.383},
                                                        {-50, -.155},
                                                        {0, -.019},
                                                        {15, .0015},
                                                        {30, .022},
                                                        {50, .070},
                                                        {100, .388},
                                                        {150, .800},
                                                        {200, 1.145},
                                                        {255, 1.436}}};
  const IndexTransmission index;
  for (const auto& [counts, delta_rad] : samples) {
    EXPECT_NEAR(index_delta_rad(index, counts), delta_rad, 1.6e-3) << counts << " counts";
    EXPECT_NEAR(vendor_delta_rad(counts), delta_rad, 1e-3) << counts << " counts: the reference itself";
    // In the dead zone a thousandth of a radian is most of a count.
    EXPECT_NEAR(index_counts(index, delta_rad), counts, counts > -20 && counts < 42 ? 1.5 : 0.7) << delta_rad;
  }
  EXPECT_EQ(vendor_counts(0.0), 15.0);
  EXPECT_EQ(vendor_counts(1.4), 247.0);
  EXPECT_EQ(vendor_counts(-1.4), -258.0);
}

TEST(MiaTransmission, InverseAgreesWithTheVendorsWithinItsOwnError) {
  const IndexTransmission index;
  for (double delta_rad = -1.37; delta_rad <= 1.43; delta_rad += 0.001) {
    const double counts = index_counts(index, delta_rad);
    const bool dead_zone = counts > -19.0 && counts < 42.0;  // the vendor's two maps are 8 counts apart there
    const double tolerance = dead_zone ? 8.5 : 2.8;
    ASSERT_NEAR(counts, vendor_counts(delta_rad), tolerance) << delta_rad << " rad";
  }
}

TEST(MiaTransmission, IndexMapRisesEverywhereAndHasAnInverse) {
  const IndexTransmission index;
  for (double counts = -300.0; counts < 300.0; counts += 0.25) {
    const double delta_rad = index_delta_rad(index, counts);
    ASSERT_LT(delta_rad, index_delta_rad(index, counts + 0.25)) << counts;
    ASSERT_NEAR(index_counts(index, delta_rad), counts, 1e-9);
  }
}

TEST(MiaTransmission, LinearMotorsHaveTheVendorsScale) {
  const Transmission transmission;
  const auto q_rad = joint_angles_rad(transmission, {255.0, 255.0, 255.0});
  EXPECT_NEAR(q_rad[0], 1.1345, 1e-4);
  EXPECT_NEAR(q_rad[1], 1.43636, 1e-9);
  EXPECT_NEAR(q_rad[2], 1.3960, 1e-4);
}

TEST(MiaTransmission, AnglesComeBackFromCountsOnBothBranchesOfTheThumb) {
  Transmission hand;
  hand.thumb = {0.0046, 3.0};
  hand.mrl = {0.0053, -2.0};
  hand.index.zero_counts = 4.5;
  for (double q = -1.37; q <= 1.37; q += 0.01) {
    const auto counts = motor_counts(hand, {q, q, q});
    const auto back = joint_angles_rad(hand, counts);
    for (const double angle : back) ASSERT_NEAR(angle, q, 1e-12);
    ASSERT_NEAR(index_delta_rad(hand.index, counts[1]), q, 1e-12);
  }
}

TEST(MiaTransmission, WholeCountsCostAtMostHalfACountOfAngle) {
  const Transmission hand;
  const std::array<double, 3> half_count_rad{0.0023, 0.0043, 0.0028};
  for (double q = 0.0; q <= 1.13; q += 0.007) {
    auto counts = motor_counts(hand, {q, q, q});
    for (double& c : counts) c = std::round(c);
    const auto back = joint_angles_rad(hand, counts);
    for (std::size_t i = 0; i < kMotors; ++i) ASSERT_NEAR(back[i], q, half_count_rad[i]) << kJointNames[i];
  }
}

TEST(MiaTransmission, ThumbIsFullyLateralOnlyWithTheIndexFlexed) {
  EXPECT_NEAR(thumb_opposition_rad(0.0), -0.0632, 1e-12);
  EXPECT_NEAR(thumb_opposition_rad(0.0731), 0.0, 1e-4);
  EXPECT_EQ(thumb_opposition_rad(1.0), 0.0);
  EXPECT_NEAR(thumb_opposition_rad(-0.6536), -0.628, 1e-3);
  EXPECT_EQ(thumb_opposition_rad(-1.4), -0.6283);
}

TEST(MiaTransmission, RefusesNumbersThatHaveNoInverse) {
  EXPECT_TRUE(check(Transmission{}).ok());
  Transmission hand;
  hand.thumb.rad_per_count = 0.0;
  EXPECT_FALSE(check(hand).ok());
  hand = {};
  hand.mrl.zero_counts = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(check(hand).ok());
  hand = {};
  hand.index.counts[4] = hand.index.counts[3];
  EXPECT_FALSE(check(hand).ok());
  hand = {};
  hand.index.delta_rad[7] = std::nan("");
  EXPECT_FALSE(check(hand).ok());
}

}  // namespace
}  // namespace embody::mia
