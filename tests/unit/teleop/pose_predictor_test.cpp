#include "core/teleop/pose_predictor.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "tests/support/heap_counter.hpp"

namespace embody::teleop {
namespace {

using Eigen::Vector3d;
using std::chrono::milliseconds;

constexpr std::array<double, 3> kRates_hz{50.0, 100.0, 240.0};
constexpr TimePoint kStart{std::chrono::seconds(5)};
const Pose kX_MH = math::pose_from({0.03, -0.08, 0.01}, {0.4, -1.1, 0.3});

PosePredictorConfig ahead(Duration time) {
  PosePredictorConfig config;
  config.ahead = time;
  return config;
}

HandPose pose_at(double t_s, const Pose& X_WM) {
  HandPose pose;
  pose.valid = true;
  pose.streak = 17;
  pose.t_capture = kStart + from_seconds(t_s);
  pose.X_WM = X_WM;
  pose.X_WH = X_WM * kX_MH;
  return pose;
}

/// Constant velocity and turning speed.
Pose straight(double t_s) {
  return math::pose_from(t_s * Vector3d(0.2, -0.1, 0.1), t_s * Vector3d(0.3, 0.5, -0.2));
}

double distance_m(const Pose& a, const Pose& b) {
  return (a.translation() - b.translation()).norm();
}
double angle_rad(const Pose& a, const Pose& b) {
  return math::angle_between(a.linear(), b.linear());
}

TEST(PosePredictor, RemovesAKnownDelayOfAConstantMotionAtAnyFrameRate) {
  for (const double rate_hz : kRates_hz) {
    PosePredictor predictor(ahead(milliseconds(60)));
    HandPose pose;
    double t_s = 0.0;
    for (int k = 0; k < static_cast<int>(3 * rate_hz); ++k) {
      t_s = k / rate_hz;
      pose = pose_at(t_s, straight(t_s));
      predictor.step(pose);
    }
    EXPECT_LT(distance_m(pose.X_WM, straight(t_s + 0.060)), 1e-6) << rate_hz << " Hz";
    EXPECT_LT(angle_rad(pose.X_WM, straight(t_s + 0.060)), 1e-6) << rate_hz << " Hz";
    EXPECT_EQ(predictor.translation_weight(), 1.0);
    EXPECT_EQ(predictor.rotation_weight(), 1.0);
    EXPECT_TRUE((pose.X_WM.inverse() * pose.X_WH).isApprox(kX_MH, 1e-12)) << "back of the hand and model stay together";
  }
}

TEST(PosePredictor, PassesPosesBitByBitWhenItIsOff) {
  PosePredictor predictor;
  for (int k = 0; k < 100; ++k) {
    HandPose pose = pose_at(0.01 * k, straight(0.01 * k));
    const HandPose given = pose;
    predictor.step(pose);
    ASSERT_EQ(pose.X_WM.matrix(), given.X_WM.matrix());
    ASSERT_EQ(pose.X_WH.matrix(), given.X_WH.matrix());
  }
}

TEST(PosePredictor, LeavesTimeValidityAndStreakAlone) {
  PosePredictor predictor(ahead(milliseconds(60)));
  for (int k = 0; k < 200; ++k) {
    HandPose pose = pose_at(0.01 * k, straight(0.01 * k));
    pose.valid = k % 50 != 49;
    const HandPose given = pose;
    predictor.step(pose);
    ASSERT_EQ(pose.valid, given.valid);
    ASSERT_EQ(pose.streak, given.streak);
    ASSERT_EQ(pose.t_capture, given.t_capture);
  }
}

TEST(PosePredictor, MovesAndTurnsTheHandByNoMoreThanTheLimits) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  PosePredictorConfig config = ahead(milliseconds(150));
  config.limit_m = 0.01;
  config.limit_rad = 0.05;
  PosePredictor predictor(config);
  Vector3d velocity = Vector3d::Zero(), spin = Vector3d::Zero();
  Pose X_WM = Pose::Identity();
  double furthest_m = 0.0, widest_rad = 0.0;
  for (int k = 0; k < 20'000; ++k) {
    if (k % 100 == 0) {
      for (int i = 0; i < 3; ++i) velocity(i) = 0.3 * normal(random), spin(i) = normal(random);
    }
    X_WM.translation() += 0.01 * velocity;
    X_WM.linear() = math::exp_so3(0.01 * spin) * X_WM.linear();
    HandPose pose = pose_at(0.01 * k, X_WM);
    predictor.step(pose);
    furthest_m = std::max(furthest_m, distance_m(pose.X_WM, X_WM));
    widest_rad = std::max(widest_rad, angle_rad(pose.X_WM, X_WM));
  }
  EXPECT_NEAR(furthest_m, 0.01, 1e-9);  // reached, and not exceeded
  EXPECT_NEAR(widest_rad, 0.05, 1e-9);
}

TEST(PosePredictor, PassesAHandAtRestAsMeasured) {
  std::mt19937 random(8);
  std::normal_distribution<double> noise(0.0, 1e-4);
  PosePredictor predictor(ahead(milliseconds(60)));
  int changed = 0;
  for (int k = 0; k < 2000; ++k) {
    Pose X_WM = straight(1.0);
    for (int i = 0; i < 3; ++i) X_WM.translation()(i) += noise(random);
    X_WM.linear() = math::exp_so3({noise(random), noise(random), noise(random)}) * X_WM.linear();
    HandPose pose = pose_at(0.01 * k, X_WM);
    predictor.step(pose);
    if (distance_m(pose.X_WM, X_WM) > 1e-4 || angle_rad(pose.X_WM, X_WM) > 1e-4) ++changed;
  }
  EXPECT_EQ(changed, 0);
}

/// Largest departure from the measured pose in the last second of four of a motion, m.
double departure_m(PosePredictor& predictor, const std::function<Pose(double)>& motion) {
  double largest_m = 0.0;
  for (int k = 0; k < 400; ++k) {
    HandPose pose = pose_at(0.01 * k, motion(0.01 * k));
    const Pose measured = pose.X_WM;
    predictor.step(pose);
    if (k >= 300) largest_m = std::max(largest_m, distance_m(pose.X_WM, measured));
  }
  return largest_m;
}

TEST(PosePredictor, FallsBackToTheMeasuredPoseWhenPredictionsDoNotComeTrue) {
  const auto swing = [](double hz) {
    return [hz](double t_s) {
      return math::pose_from({0.02 * std::sin(6.2831853 * hz * t_s), 0, 0}, Vector3d::Zero());
    };
  };
  PosePredictor slow(ahead(milliseconds(100)));
  EXPECT_GT(departure_m(slow, swing(0.5)), 0.004) << "a slow swing is predicted";
  PosePredictor fast(ahead(milliseconds(100)));
  EXPECT_LT(departure_m(fast, swing(4.0)), 1e-9) << "a swing that turns within the delay is not";
}

TEST(PosePredictor, PredictionsMakeTheErrorOfAKnownDelaySmaller) {
  const auto reach = [](double t_s) {  // back and forth, smooth, 0.7 s each way
    const double s = 0.5 - 0.5 * std::cos(3.14159265 * t_s / 0.7);
    return math::pose_from({0.25 * s, 0.1 * s, 0.0}, {0.0, 0.6 * s, 0.0});
  };
  PosePredictor predictor(ahead(milliseconds(50)));
  double held_m2 = 0.0, predicted_m2 = 0.0;
  for (int k = 0; k < 1000; ++k) {
    HandPose pose = pose_at(0.01 * k, reach(0.01 * k));
    const Pose due = reach(0.01 * k + 0.050);
    held_m2 += std::pow(distance_m(pose.X_WM, due), 2);
    predictor.step(pose);
    predicted_m2 += std::pow(distance_m(pose.X_WM, due), 2);
  }
  EXPECT_LT(predicted_m2, 0.25 * held_m2) << "less than half of the root mean square error";
}

TEST(PosePredictor, StartsAfreshAfterInvalidPosesJumpsAndGaps) {
  const auto running = [] {
    PosePredictor predictor(ahead(milliseconds(60)));
    for (int k = 0; k < 300; ++k) {
      HandPose pose = pose_at(0.01 * k, straight(0.01 * k));
      predictor.step(pose);
    }
    EXPECT_EQ(predictor.translation_weight(), 1.0);
    return predictor;
  };
  HandPose invalid = pose_at(3.0, straight(3.0));
  invalid.valid = false;
  HandPose jumped = pose_at(3.0, straight(30.0));
  jumped.jumps = 1;
  HandPose broken = pose_at(3.0, straight(3.0));
  broken.X_WM.matrix()(0, 3) = std::nan("");
  for (HandPose pose : {invalid, jumped, broken, pose_at(3.3, straight(3.3)), pose_at(2.5, straight(2.5))}) {
    PosePredictor predictor = running();
    predictor.step(pose);
    EXPECT_EQ(predictor.translation_weight(), 0.0);
    HandPose next = pose_at(to_seconds(pose.t_capture - kStart) + 0.01, straight(30.0));
    next.jumps = pose.jumps;
    predictor.step(next);
    EXPECT_EQ(next.X_WM.matrix(), straight(30.0).matrix()) << "passes as measured, whatever came before";
  }
}

TEST(PosePredictor, KeepsWorkingWhenMorePredictionsAreUnderWayThanItCanRemember) {
  PosePredictor predictor(ahead(milliseconds(200)));
  HandPose pose;
  double t_s = 0.0;
  for (int k = 0; k < 20'000; ++k) {
    t_s = k / 5000.0;
    pose = pose_at(t_s, straight(t_s));
    predictor.step(pose);
  }
  EXPECT_EQ(predictor.translation_weight(), 1.0);
  EXPECT_NEAR(distance_m(pose.X_WM, straight(t_s)), 0.03, 1e-9) << "the limit";
}

TEST(PosePredictor, UsesNoHeap) {
  PosePredictor predictor(ahead(milliseconds(60)));
  const std::uint64_t before = test::heap_allocations();
  for (int k = 0; k < 500; ++k) {
    HandPose pose = pose_at(0.01 * k, straight(0.01 * k));
    predictor.step(pose);
  }
  EXPECT_EQ(test::heap_allocations() - before, 0U);
  static_assert(noexcept(predictor.step(std::declval<HandPose&>())));
}

}  // namespace
}  // namespace embody::teleop
