#include "core/embodiment/pad_samples.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/math/triangle_distance.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody {
namespace {

using Eigen::Vector3d;
using Samples = std::vector<PadSample>;

constexpr double kPi = 3.14159265358979323846;

/// A pad of a finger's size anywhere in its link; `facing` leans along the axis as a careless file may have it.
ContactPad any_pad(test::RandomValues& random, bool round) {
  ContactPad pad;
  pad.link = "finger";
  pad.from_m = random.vector<3>(-0.05, 0.05);
  const Vector3d along = random.rotation(1.0).normalized();
  pad.to_m = pad.from_m + random(0.005, 0.05) * along;
  pad.facing = along.cross(random.rotation(1.0)).normalized() + random(-0.5, 0.5) * along;
  pad.radius_m = random(0.004, 0.012);
  pad.width_m = round ? 0.0 : random(0.005, 0.02);
  return pad;
}

ContactPad flat_pad(double length_m, double width_m, double z_m = 0.0) {
  return {"finger", {0.0, 0.0, z_m}, {length_m, 0.0, z_m}, 0.0, {0.0, 0.0, 1.0}, width_m};
}

Samples samples_of(const std::vector<ContactPad>& pads, std::size_t count = kPadSamples, std::uint64_t seed = 1) {
  const std::vector<Pose> poses(pads.size(), Pose::Identity());
  const auto samples = pad_samples(pads, poses, count, seed);
  EXPECT_TRUE(samples.ok()) << samples.error().detail.c_str();
  return samples ? *samples : Samples{};
}

double least_spacing(const Samples& samples) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) least = std::min(least, (samples[i].p_L - samples[j].p_L).norm());
  }
  return least;
}

TEST(PadSamples, LieOnTheRoundPadOnTheSideThatItFaces) {
  test::RandomValues random(81);
  for (int trial = 0; trial < 50; ++trial) {
    const ContactPad pad = any_pad(random, true);
    const Vector3d along = (pad.to_m - pad.from_m).normalized();
    const Vector3d out = (pad.facing - pad.facing.dot(along) * along).normalized();
    bool beyond_from = false, beyond_to = false;
    for (const PadSample& sample : samples_of({pad})) {
      const Vector3d from_axis = sample.p_L - math::nearest_on_segment(sample.p_L, pad.from_m, pad.to_m);
      ASSERT_NEAR(from_axis.norm(), pad.radius_m, 1e-12);
      ASSERT_GE(from_axis.dot(out), -1e-12);
      ASSERT_LT((sample.normal_L - from_axis / pad.radius_m).norm(), 1e-9);
      beyond_from |= (sample.p_L - pad.from_m).dot(along) < 0.0;
      beyond_to |= (sample.p_L - pad.to_m).dot(along) > 0.0;
    }
    EXPECT_TRUE(beyond_from && beyond_to) << "both ends are part of the pad";
  }
}

TEST(PadSamples, LieInTheRectangleOfTheFlatPad) {
  test::RandomValues random(82);
  for (int trial = 0; trial < 50; ++trial) {
    const ContactPad pad = any_pad(random, false);
    const double length = (pad.to_m - pad.from_m).norm();
    const Vector3d along = (pad.to_m - pad.from_m) / length;
    const Vector3d out = (pad.facing - pad.facing.dot(along) * along).normalized();
    for (const PadSample& sample : samples_of({pad})) {
      const Vector3d p = sample.p_L - pad.from_m;
      ASSERT_NEAR(p.dot(out), pad.radius_m, 1e-12);
      ASSERT_GE(p.dot(along), -1e-12);
      ASSERT_LE(p.dot(along), length + 1e-12);
      ASSERT_LE(std::abs(p.dot(along.cross(out))), 0.5 * pad.width_m + 1e-12);
      ASSERT_LT((sample.normal_L - out).norm(), 1e-12);
    }
  }
}

TEST(PadSamples, AreAsManyAsAskedFor) {
  test::RandomValues random(83);
  const std::vector<ContactPad> pads{any_pad(random, true), any_pad(random, false), any_pad(random, true)};
  for (const std::size_t count : {1U, 2U, 7U, 100U, 333U}) EXPECT_EQ(samples_of(pads, count).size(), count);
}

TEST(PadSamples, AreTheSameForTheSameArgumentsAndOthersForAnotherSeed) {
  test::RandomValues random(84);
  const std::vector<ContactPad> pads{any_pad(random, true), any_pad(random, false)};
  const Samples once = samples_of(pads), again = samples_of(pads), other = samples_of(pads, kPadSamples, 2);
  double difference = 0.0;
  for (std::size_t i = 0; i < once.size(); ++i) {
    ASSERT_EQ(once[i].pad, again[i].pad);
    ASSERT_EQ(once[i].p_L, again[i].p_L);
    difference += (once[i].p_L - other[i].p_L).norm();
  }
  EXPECT_GT(difference, 0.01);
}

TEST(PadSamples, KeepFarLargerDistancesThanRandomPoints) {
  test::RandomValues random(85);
  constexpr double kLength = 0.03, kWidth = 0.012;
  const double largest = std::sqrt(2.0 / std::sqrt(3.0) * kLength * kWidth / kPadSamples);  // of a hexagonal grid
  double even = 0.0, uneven = 0.0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Samples samples = samples_of({flat_pad(kLength, kWidth)}, kPadSamples, seed);
    even += least_spacing(samples) / 10.0;
    EXPECT_GT(least_spacing(samples), 0.5 * largest);
    Samples points(kPadSamples);
    for (PadSample& point : points) point.p_L = {random(0.0, kLength), random(0.0, kWidth), 0.0};
    uneven += least_spacing(points) / 10.0;
  }
  EXPECT_GT(even, 8.0 * uneven) << "mean least distance " << 1e3 * even << " mm, of random points " << 1e3 * uneven;
  EXPECT_GT(even, 0.6 * largest);
}

TEST(PadSamples, LeaveNoHoleInThePad) {
  constexpr double kLength = 0.03, kWidth = 0.012;
  const double largest = std::sqrt(2.0 / std::sqrt(3.0) * kLength * kWidth / kPadSamples);
  const Samples samples = samples_of({flat_pad(kLength, kWidth)});
  for (double x = 0.0; x <= kLength; x += 2e-4) {
    for (double y = -0.5 * kWidth; y <= 0.5 * kWidth; y += 2e-4) {
      double nearest = 1.0;
      for (const PadSample& sample : samples) nearest = std::min(nearest, (sample.p_L - Vector3d(x, y, 0.0)).norm());
      ASSERT_LT(nearest, 1.3 * largest) << "at " << x << ", " << y;
    }
  }
}

TEST(PadSamples, ShareTheFingerByAreaAmongItsPadsAndTheirParts) {
  const std::vector<ContactPad> flat{flat_pad(0.01, 0.01), flat_pad(0.03, 0.01, 0.1)};
  const Samples shared = samples_of(flat, 200);
  const auto first = std::count_if(shared.begin(), shared.end(), [](const PadSample& s) { return s.pad == 0; });
  EXPECT_NEAR(static_cast<double>(first), 50.0, 8.0);

  const ContactPad round{"finger", {0.0, 0.0, 0.0}, {0.02, 0.0, 0.0}, 0.01, {0.0, 0.0, 1.0}, 0.0};
  const Samples samples = samples_of({round}, 400);
  std::array<double, 3> parts{};  // before, on and beyond the cylinder
  Vector3d mean_normal = Vector3d::Zero();
  for (const PadSample& s : samples) {
    parts[s.p_L.x() < 0.0 ? 0 : (s.p_L.x() > 0.02 ? 2 : 1)] += 1.0 / 400.0;
    mean_normal += s.normal_L / 400.0;
  }
  EXPECT_NEAR(parts[0], 0.25, 0.03);
  EXPECT_NEAR(parts[1], 0.5, 0.03);
  EXPECT_NEAR(parts[2], 0.25, 0.03);
  // Half a cylinder has the mean normal 2/pi, a hemisphere 1/2.
  EXPECT_LT((mean_normal - Vector3d(0.0, 0.0, 0.5 * 2.0 / kPi + 0.5 * 0.5)).norm(), 0.02);
}

TEST(PadSamples, DoNotLieInsideOfTheNeighbouringPhalanx) {
  const ContactPad middle{"middle", {0.0, 0.0, 0.0}, {0.025, 0.0, 0.0}, 0.008, {0.0, 0.0, 1.0}, 0.0};
  ContactPad distal = middle;
  distal.link = "distal";
  Pose X_PD = Pose::Identity();
  X_PD.translation().x() = 0.025;
  const auto samples = pad_samples(std::array{middle, distal}, std::array{Pose::Identity(), X_PD});
  ASSERT_TRUE(samples.ok());
  for (const PadSample& sample : *samples) {
    const Vector3d p_P = sample.pad == 0 ? sample.p_L : Vector3d(X_PD * sample.p_L);
    const Vector3d on_axis = math::nearest_on_segment(p_P, middle.from_m, X_PD * distal.to_m);
    ASSERT_GT((p_P - on_axis).norm(), 0.008 - 1e-6);
  }
}

TEST(PadArea, IsThatOfHalfACapsuleOrOfARectangle) {
  const ContactPad round{"finger", {0.0, 0.0, 0.0}, {0.02, 0.0, 0.0}, 0.01, {0.0, 0.0, 1.0}, 0.0};
  EXPECT_NEAR(*pad_area_m2(round), kPi * 0.01 * 0.02 + 2.0 * kPi * 1e-4, 1e-15);
  EXPECT_NEAR(*pad_area_m2(flat_pad(0.02, 0.01)), 2e-4, 1e-15);
  ContactPad hemisphere = round;
  hemisphere.to_m = hemisphere.from_m;
  EXPECT_NEAR(*pad_area_m2(hemisphere), 2.0 * kPi * 1e-4, 1e-15);
  for (const PadSample& sample : samples_of({hemisphere})) {
    EXPECT_NEAR(sample.p_L.norm(), 0.01, 1e-12);
    EXPECT_GE(sample.p_L.z(), 0.0);
  }
}

TEST(PadSamples, RefusePadsWithoutSurfaceByNameOfTheirLink) {
  const ContactPad good{"tip", {0.0, 0.0, 0.0}, {0.02, 0.0, 0.0}, 0.01, {0.0, 0.0, 1.0}, 0.0};
  std::array<ContactPad, 7> bad;
  bad.fill(good);
  bad[0].radius_m = 0.0;
  bad[1].facing.setZero();
  bad[2].facing = {1.0, 0.0, 0.01};
  bad[3].to_m.y() = std::numeric_limits<double>::quiet_NaN();
  bad[4].radius_m = -0.01;
  bad[5].width_m = -0.01;
  bad[6].width_m = 0.01;
  bad[6].to_m = bad[6].from_m;
  for (std::size_t i = 0; i < bad.size(); ++i) {
    const auto samples = pad_samples(std::array{good, bad[i]}, std::array{Pose::Identity(), Pose::Identity()});
    ASSERT_FALSE(samples.ok()) << i;
    EXPECT_EQ(samples.error().code, Errc::kInvalidArgument);
    EXPECT_NE(samples.error().detail.view().find("'tip'"), std::string_view::npos) << samples.error().detail.c_str();
  }
  const std::array pose{Pose::Identity()};
  EXPECT_FALSE(pad_samples({}, {}).ok());
  EXPECT_FALSE(pad_samples(std::array{good}, {}).ok());
  EXPECT_FALSE(pad_samples(std::array{good}, pose, 0).ok());
  EXPECT_FALSE(pad_samples(std::array{good}, pose, 1'000'000'000).ok());
}

TEST(PadSamples, AreNowhereOnAHiddenPadAndRefusedWhereAllPadsAreHidden) {
  const ContactPad outer{"tip", {0.0, 0.0, 0.0}, {0.02, 0.0, 0.0}, 0.01, {0.0, 0.0, 1.0}, 0.0};
  ContactPad inner = outer;
  inner.radius_m = 0.005;
  const auto poses = std::array{Pose::Identity(), Pose::Identity()};
  const auto samples = pad_samples(std::array{outer, inner}, poses);
  ASSERT_TRUE(samples.ok());
  for (const PadSample& sample : *samples) ASSERT_EQ(sample.pad, 0U);
  std::array<ContactPad, 3> bundle;  // each half turns into the bundle
  for (std::size_t i = 0; i < 3; ++i) {
    const double angle = 2.0 * kPi / 3.0 * static_cast<double>(i);
    const Vector3d off_m = 6e-5 * Vector3d(0.0, std::cos(angle), std::sin(angle));
    bundle[i] = {"tip", outer.from_m + off_m, outer.to_m + off_m, 0.01, -off_m.normalized(), 0.0};
  }
  const auto none = pad_samples(bundle, std::array{Pose::Identity(), Pose::Identity(), Pose::Identity()});
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, Errc::kInvalidArgument);
}

}  // namespace
}  // namespace embody
