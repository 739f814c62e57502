#include "core/teleop/pose_resampler.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <vector>

#include "tests/support/heap_counter.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::teleop {
namespace {

using math::Pose;
using std::chrono::milliseconds;
constexpr TimePoint kStart{std::chrono::seconds(50)};

TimePoint at_seconds(double t_s) {
  return kStart + from_seconds(t_s);
}

/// Capture times at 100 Hz with up to 4 ms of jitter and now and then a missing frame.
std::vector<double> frame_times(test::RandomValues& random, double duration_s) {
  std::vector<double> times;
  for (double t = 0.0; t < duration_s; t += 0.01) {
    if (random(0.0, 1.0) < 0.05) continue;
    times.push_back(t + random(-0.004, 0.004));
  }
  return times;
}

double difference(const Pose& a, const Pose& b) {
  return std::max((a.translation() - b.translation()).norm(), math::angle_between(a.linear(), b.linear()));
}

TEST(PoseResampler, ReproducesMotionAtConstantVelocityExactly) {
  test::RandomValues random(1);
  for (int run = 0; run < 50; ++run) {
    const Pose X_0 = math::pose_from(random.vector<3>(-1.0, 1.0), random.rotation(3.0));
    const Eigen::Vector3d v = random.vector<3>(-2.0, 2.0);
    const Eigen::Vector3d w = random.rotation(6.0);
    const auto motion = [&](double t_s) {
      Pose X = X_0;
      X.translation() += v * t_s;
      X.linear() = X_0.linear() * math::exp_so3(w * t_s);
      return X;
    };
    PoseResampler poses;
    const std::vector<double> times = frame_times(random, 0.5);
    std::size_t next = 0;
    int compared = 0;
    for (double t = 0.0; t < 0.45; t += 0.002) {
      while (next < times.size() && times[next] < t + 0.025) {
        poses.add(at_seconds(times[next]), motion(times[next]));
        ++next;
      }
      if (t < times.front() || t > times[next - 1]) continue;  // nothing is extrapolated
      const auto X = poses.at(at_seconds(t));
      ASSERT_TRUE(X.has_value());
      const double t_ns = to_seconds(from_seconds(t));  // the clock has whole nanoseconds
      ASSERT_LT(difference(*X, motion(t_ns)), 1e-7) << "run " << run << " at " << t << " s";
      ++compared;
    }
    ASSERT_GT(compared, 150);
  }
}

/// Sum of sines: smooth, with wrist-like speeds (up to about 1 m/s and 4 rad/s).
class SmoothPath {
 public:
  explicit SmoothPath(test::RandomValues& random) {
    for (int i = 0; i < 6; ++i) {
      for (int k = 0; k < 3; ++k) {
        amplitude_(i, k) = random(-1.0, 1.0) * (i < 3 ? 0.4 : 0.1) / (k + 1);
        omega_(i, k) = random(1.0, 6.0) * (k + 1);
        phase_(i, k) = random(0.0, 6.28);
      }
    }
  }
  Pose operator()(double t_s) const {
    Eigen::Matrix<double, 6, 1> c;
    for (int i = 0; i < 6; ++i) {
      c[i] = (amplitude_.row(i).array() * (omega_.row(i).array() * t_s + phase_.row(i).array()).sin()).sum();
    }
    return math::pose_from(c.tail<3>(), c.head<3>());
  }

 private:
  Eigen::Matrix<double, 6, 3> amplitude_, omega_, phase_;
};

/// Translational and rotational velocity (in the body) between two poses.
math::Vector6 velocity(const Pose& X_WA, const Pose& X_WB, double dt_s) {
  math::Vector6 V;
  V.head<3>() = math::log_so3(X_WA.linear().transpose() * X_WB.linear()) / dt_s;
  V.tail<3>() = (X_WB.translation() - X_WA.translation()) / dt_s;
  return V;
}

TEST(PoseResampler, HasAContinuousVelocityAcrossItsKnots) {
  constexpr double kStep_s = 1e-6;
  double worst_m_s = 0.0;
  double worst_rad_s = 0.0;
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    test::RandomValues random(seed);
    const SmoothPath path(random);
    std::vector<double> times = frame_times(random, 1.0);
    PoseResampler poses;
    for (std::size_t i = 0; i < times.size(); ++i) {
      poses.add(at_seconds(times[i]), path(times[i]));
      if (i < 4) continue;
      const double knot = times[i - 2];  // two frames behind the newest one
      const Pose X_0 = *poses.at(at_seconds(knot - kStep_s));
      const Pose X_1 = *poses.at(at_seconds(knot));
      const Pose X_2 = *poses.at(at_seconds(knot + kStep_s));
      const math::Vector6 jump = velocity(X_1, X_2, kStep_s) - velocity(X_0, X_1, kStep_s);
      worst_rad_s = std::max(worst_rad_s, jump.head<3>().norm());
      worst_m_s = std::max(worst_m_s, jump.tail<3>().norm());
    }
  }
  std::printf("largest jump of velocity at a knot: %.2e m/s, %.2e rad/s\n", worst_m_s, worst_rad_s);
  EXPECT_LT(worst_m_s, 2e-4);    // of some 1 m/s
  EXPECT_LT(worst_rad_s, 2e-3);  // of some 4 rad/s: the charts of two knots agree to third order
}

TEST(PoseResampler, FollowsASmoothPathWithinATenthOfAMillimetre) {
  test::RandomValues random(7);
  const SmoothPath path(random);
  PoseResampler poses;
  double worst = 0.0;
  for (int k = 0; k < 200; ++k) {
    poses.add(at_seconds(k * 0.01), path(k * 0.01));
    if (k < 4) continue;
    for (double t = k * 0.01 - 0.02; t < k * 0.01 - 0.01; t += 0.002) {
      worst = std::max(worst, (poses.at(at_seconds(t))->translation() - path(t).translation()).norm());
    }
  }
  std::printf("largest error between frames: %.4f mm\n", worst * 1e3);
  EXPECT_LT(worst, 1e-4);
}

TEST(PoseResampler, PassesThroughItsKnots) {
  test::RandomValues random(8);
  PoseResampler poses;
  std::vector<Pose> kept;
  for (int k = 0; k < 10; ++k) {
    kept.push_back(math::pose_from(random.vector<3>(-1.0, 1.0), random.rotation(1.0)));
    poses.add(kStart + k * milliseconds(10), kept.back());
  }
  for (int k = 0; k < 10; ++k) {
    EXPECT_LT(difference(*poses.at(kStart + k * milliseconds(10)), kept[static_cast<std::size_t>(k)]), 1e-9) << k;
  }
}

TEST(PoseResampler, ExtrapolatesNeitherForwardNorBackward) {
  PoseResampler poses;
  EXPECT_FALSE(poses.at(kStart).has_value());
  const auto pose = [](int k) { return math::pose_from({0.1 * k, 0.0, 0.0}, {0.0, 0.2 * k, 0.0}); };
  for (int k = 0; k < 8; ++k) poses.add(kStart + k * milliseconds(10), pose(k));
  for (const int later_ms : {70, 71, 100, 100'000}) {
    EXPECT_LT(difference(*poses.at(kStart + milliseconds(later_ms)), pose(7)), 1e-12) << later_ms;
  }
  for (const int earlier_ms : {0, 1, 100'000}) {
    EXPECT_LT(difference(*poses.at(kStart - milliseconds(earlier_ms)), pose(0)), 1e-12) << earlier_ms;
  }
}

TEST(PoseResampler, IgnoresPosesThatAreNotNewer) {
  PoseResampler poses;
  const Pose first = math::pose_from({1.0, 0.0, 0.0}, Eigen::Vector3d::Zero());
  const Pose other = math::pose_from({9.0, 0.0, 0.0}, Eigen::Vector3d::Zero());
  poses.add(kStart, first);
  poses.add(kStart, other);
  poses.add(kStart - milliseconds(10), other);
  EXPECT_EQ(poses.size(), 1U);
  EXPECT_LT(difference(*poses.at(kStart), first), 1e-12);
}

TEST(PoseResampler, StartsAfreshAfterAGap) {
  PoseResampler poses;
  for (int k = 0; k < 8; ++k) poses.add(kStart + k * milliseconds(10), Pose::Identity());
  const TimePoint newest = kStart + milliseconds(70);
  const Pose moved = math::pose_from({5.0, 0.0, 0.0}, Eigen::Vector3d::Zero());

  PoseResampler bridged = poses;
  bridged.add(newest + PoseResampler::kMaxGap, moved);
  EXPECT_EQ(bridged.size(), 9U);
  const double halfway = bridged.at(newest + PoseResampler::kMaxGap / 2)->translation().x();
  EXPECT_GT(halfway, 0.5);
  EXPECT_LT(halfway, 4.5);

  poses.add(newest + PoseResampler::kMaxGap + Duration{1}, moved);
  EXPECT_EQ(poses.size(), 1U);
  EXPECT_LT(difference(*poses.at(newest + PoseResampler::kMaxGap / 2), moved), 1e-12) << "nothing from before the gap";
}

TEST(PoseResampler, KeepsTheNewestPosesAndForgetsTheOldest) {
  PoseResampler poses;
  const auto pose = [](int k) { return math::pose_from({0.01 * k, 0.0, 0.0}, Eigen::Vector3d::Zero()); };
  for (int k = 0; k < 1000; ++k) {
    poses.add(kStart + k * milliseconds(10), pose(k));
    ASSERT_LE(poses.size(), PoseResampler::kCapacity);
    ASSERT_LT(difference(*poses.at(kStart + k * milliseconds(10)), pose(k)), 1e-12);
  }
}

// Trackers run at up to 1000 frames per second, and the delay may be configured up to 200 ms.
TEST(PoseResampler, InterpolatesAtEveryConfigurableDelayAndUsualFrameRate) {
  const struct {
    double rate_hz, delay_s;
  } kCases[] = {{100.0, 0.025}, {300.0, 0.025}, {500.0, 0.025}, {1000.0, 0.025}, {100.0, 0.200}, {300.0, 0.060}};
  for (const auto& [rate_hz, delay_s] : kCases) {
    PoseResampler poses;
    const auto pose = [](double t_s) { return math::pose_from({0.5 * t_s, 0.0, 0.0}, Eigen::Vector3d::Zero()); };
    double worst = 0.0;
    for (int k = 0; k < 500; ++k) {
      const double t = k / rate_hz;
      poses.add(at_seconds(t), pose(t));
      if (t < 2 * delay_s) continue;
      worst = std::max(worst, difference(*poses.at(at_seconds(t - delay_s)), pose(t - delay_s)));
    }
    EXPECT_LT(worst, 1e-6) << rate_hz << " Hz with a delay of " << delay_s << " s";
  }
}

TEST(PoseResampler, UsesNoHeap) {
  PoseResampler poses;
  const std::uint64_t before = test::heap_allocations();
  for (int k = 0; k < 100; ++k) {
    poses.add(kStart + k * milliseconds(10), Pose::Identity());
    (void)poses.at(kStart + k * milliseconds(10) - milliseconds(25));
  }
  EXPECT_EQ(test::heap_allocations(), before);
}

}  // namespace
}  // namespace embody::teleop
