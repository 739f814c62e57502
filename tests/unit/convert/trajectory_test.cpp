// Laws of resampling and cutting.
#include "daemon/convert/trajectory.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/convert/random_trajectory.hpp"

namespace embody::convert {
namespace {

using test::random_trajectory;

Trajectory resampled(const Trajectory& trajectory, double rate_hz) {
  Result<Trajectory> result = resample(trajectory, rate_hz);
  EXPECT_TRUE(result.ok()) << result.error().detail.view();
  return result.ok() ? *result : Trajectory{};
}

TEST(Resampling, AtTheSameRateChangesNothing) {
  for (const double rate_hz : {29.97, 100.0, 183.0}) {
    const Trajectory before = random_trajectory(400, rate_hz, 1);
    const Trajectory after = resampled(before, rate_hz);
    ASSERT_EQ(after.rows.size(), before.rows.size()) << rate_hz;
    for (std::size_t i = 0; i < before.rows.size(); ++i) {
      EXPECT_EQ(after.rows[i].time_s, before.rows[i].time_s);
      EXPECT_EQ(after.rows[i].p_m, before.rows[i].p_m);
      EXPECT_EQ(after.rows[i].orientation.coeffs(), before.rows[i].orientation.coeffs());
      EXPECT_EQ(after.rows[i].valid, before.rows[i].valid);
    }
    EXPECT_EQ(after.q, before.q);
  }
}

TEST(Resampling, KeepsEveryRowWhenTheRateIsMultiplied) {
  const Trajectory before = random_trajectory(50, 100.0, 2);
  const Trajectory after = resampled(before, 500.0);
  ASSERT_EQ(after.rows.size(), 49U * 5U + 1U);
  for (std::size_t i = 0; i < before.rows.size(); ++i) {
    EXPECT_EQ(after.rows[5 * i].p_m, before.rows[i].p_m) << i;
    EXPECT_EQ(after.joints_of(5 * i)[0], before.joints_of(i)[0]) << i;
  }
  const Trajectory back = resampled(after, 100.0);
  ASSERT_EQ(back.rows.size(), before.rows.size());
  for (std::size_t i = 0; i < before.rows.size(); ++i) EXPECT_EQ(back.rows[i].p_m, before.rows[i].p_m);
}

TEST(Resampling, GivesEvenTimesWithinTheTrajectoryUnitQuaternionsAndNoJumpsOfSign) {
  for (const double rate_hz : {7.0, 61.7, 99.0, 101.0, 1000.0}) {
    const Trajectory before = random_trajectory(120, 100.0, 3);
    const Trajectory after = resampled(before, rate_hz);
    const double first_s = before.rows.front().time_s, last_s = before.rows.back().time_s;
    ASSERT_FALSE(after.rows.empty());
    EXPECT_EQ(after.rows.front().time_s, first_s);
    EXPECT_LE(after.rows.back().time_s, last_s + 1e-9) << "extrapolates";
    EXPECT_GT(after.rows.back().time_s, last_s - 1.0 / rate_hz - 1e-9) << "ends too early";
    for (std::size_t i = 0; i < after.rows.size(); ++i) {
      EXPECT_NEAR(after.rows[i].orientation.norm(), 1.0, 1e-12);
      if (i == 0) continue;
      EXPECT_NEAR(after.rows[i].time_s - after.rows[i - 1].time_s, 1.0 / rate_hz, 1e-8);
      EXPECT_GE(after.rows[i].orientation.dot(after.rows[i - 1].orientation), 0.0);
    }
  }
}

TEST(Resampling, FollowsAScrewOfConstantSpeedExactly) {
  Trajectory screw = random_trajectory(40, 100.0, 4);
  const Eigen::Vector3d w_rad_s(20.0, -30.0, 10.0), v_m_s(0.3, 0.1, -0.2);
  const auto pose = [&](double t) { return math::pose_from(v_m_s * t, w_rad_s * t); };
  for (std::size_t i = 0; i < screw.rows.size(); ++i) {
    set_pose(screw.rows[i], pose(screw.rows[i].time_s));
    screw.joints_of(i)[0] = 3.0 * screw.rows[i].time_s;
  }
  make_continuous(screw);
  const Trajectory after = resampled(screw, 333.0);
  for (std::size_t i = 0; i < after.rows.size(); ++i) {
    const TrajectoryRow& row = after.rows[i];
    EXPECT_TRUE(pose_of(row).isApprox(pose(row.time_s), 1e-9)) << i;
    EXPECT_NEAR(after.joints_of(i)[0], 3.0 * row.time_s, 1e-12) << i;
  }
}

TEST(Resampling, MarksARowValidOnlyBetweenTwoValidOnes) {
  Trajectory before = random_trajectory(5, 100.0, 5);
  for (TrajectoryRow& row : before.rows) row.valid = true;
  before.rows[2].valid = false;
  const Trajectory after = resampled(before, 200.0);
  const std::array<bool, 9> expected{true, true, true, false, false, false, true, true, true};
  ASSERT_EQ(after.rows.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(after.rows[i].valid, expected[i]) << i;
}

TEST(Resampling, SpreadsWhatIsUnknownNoFurtherThanItsNeighbours) {
  Trajectory before = random_trajectory(6, 100.0, 6);
  for (std::size_t i = 0; i < 2; ++i) {
    const double time_s = before.rows[i].time_s;
    before.rows[i] = TrajectoryRow{};
    before.rows[i].time_s = time_s;
  }
  const Trajectory after = resampled(before, 300.0);
  for (std::size_t i = 0; i < after.rows.size(); ++i) {
    EXPECT_EQ(after.rows[i].p_m.allFinite(), i >= 6) << i;
    EXPECT_EQ(after.rows[i].orientation.coeffs().allFinite(), i >= 6) << i;
    if (i < 6) {
      EXPECT_FALSE(after.rows[i].valid) << i;
    }
  }
}

TEST(Resampling, OfOneRowIsThatRow) {
  EXPECT_EQ(resampled(random_trajectory(1, 100.0, 7), 1000.0).rows.size(), 1U);
}

TEST(Resampling, RefusesRatesThatAreNoneAndNothingToResample) {
  const Trajectory trajectory = random_trajectory(10, 100.0, 8);
  for (const double rate_hz : {0.0, -1.0, 1e6, std::nan(""), HUGE_VAL}) {
    EXPECT_FALSE(resample(trajectory, rate_hz).ok()) << rate_hz;
  }
  EXPECT_FALSE(resample(Trajectory{}, 100.0).ok());
  Trajectory endless = trajectory;
  endless.rows.back().time_s = 1e9;
  EXPECT_FALSE(resample(endless, 1000.0).ok());
}

TEST(Trajectory, QuaternionsKeepTheirSignWhateverTheyComeAs) {
  Trajectory trajectory = random_trajectory(300, 100.0, 9);
  const Trajectory before = trajectory;
  test::RandomValues random(10);
  for (TrajectoryRow& row : trajectory.rows) {
    if (random(0.0, 1.0) < 0.5) row.orientation.coeffs() *= -1.0;
  }
  make_continuous(trajectory);
  EXPECT_GE(trajectory.rows[0].orientation.w(), 0.0);
  for (std::size_t i = 0; i < trajectory.rows.size(); ++i) {
    EXPECT_TRUE(pose_of(trajectory.rows[i]).isApprox(pose_of(before.rows[i]), 1e-12));
    if (i > 0) {
      EXPECT_GE(trajectory.rows[i].orientation.dot(trajectory.rows[i - 1].orientation), 0.0) << i;
    }
  }
}

TEST(Trajectory, SlicesHaveTheRowsAndFramesOfTheirPlace) {
  const Trajectory whole = random_trajectory(30, 100.0, 11);
  const Trajectory part = slice(whole, 4, 9);
  ASSERT_EQ(part.rows.size(), 6U);
  EXPECT_EQ(part.first_frame, 15U);
  EXPECT_EQ(part.last_frame, 20U);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(part.rows[i].time_s, whole.rows[4 + i].time_s);
    EXPECT_EQ(part.rows[i].p_m, whole.rows[4 + i].p_m);
    for (std::size_t j = 0; j < 2; ++j) EXPECT_EQ(part.joints_of(i)[j], whole.joints_of(4 + i)[j]);
  }
}

}  // namespace
}  // namespace embody::convert
