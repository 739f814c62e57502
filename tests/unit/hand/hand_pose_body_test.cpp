#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/hand/hand_pose_estimator.hpp"
#include "tests/support/heap_counter.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::hand {
namespace {

Pose random_pose(test::RandomValues& random) {
  return math::pose_from(random.vector<3>(-2.0, 2.0), random.rotation(3.1));
}

MarkerFrame frame_with(const Pose& X_W, double residual_m = 0.0005) {
  MarkerFrame frame;
  frame.frame_number = 7;
  frame.body = {X_W, residual_m, true};
  return frame;
}

TEST(HandPoseFromABody, IsTheBodysPoseTimesTheFixedTransforms) {
  test::RandomValues random(/*seed=*/8);
  for (int i = 0; i < 1000; ++i) {
    BodyPoseConfig config;
    config.X_BodyH = random_pose(random);
    const Pose X_HM = random_pose(random), X_WBody = random_pose(random);
    HandPoseEstimator estimator(config, X_HM);
    const HandPose pose = estimator.step(frame_with(X_WBody));
    ASSERT_TRUE(pose.valid);
    ASSERT_TRUE(pose.X_WH.isApprox(X_WBody * config.X_BodyH, 1e-12));
    ASSERT_TRUE(pose.X_WM.isApprox(X_WBody * config.X_BodyH * X_HM, 1e-12));
    ASSERT_EQ(pose.fit_error_m, 0.0005);
    ASSERT_EQ(pose.frame_number, 7U);
    ASSERT_EQ(pose.sequence, 1U);
  }
}

TEST(HandPoseFromABody, KeepsTheLastPoseWhenTheBodyIsNotToBeTrusted) {
  test::RandomValues random(/*seed=*/9);
  HandPoseEstimator estimator(BodyPoseConfig{}, Pose::Identity());
  const HandPose good = estimator.step(frame_with(random_pose(random)));
  ASSERT_TRUE(good.valid);
  MarkerFrame hidden = frame_with(random_pose(random));
  hidden.body.visible = false;
  MarkerFrame not_a_number = frame_with(random_pose(random));
  not_a_number.body.X_W.translation().y() = std::nan("");
  MarkerFrame no_rotation = frame_with(random_pose(random));
  no_rotation.body.X_W.linear() *= 1.01;
  for (const MarkerFrame& frame : {hidden, not_a_number, no_rotation, frame_with(random_pose(random), 0.0041),
                                   frame_with(random_pose(random), std::nan("")), MarkerFrame{}}) {
    const HandPose pose = estimator.step(frame);
    EXPECT_FALSE(pose.valid);
    EXPECT_TRUE(pose.X_WH.isApprox(good.X_WH, 0.0));
    EXPECT_TRUE(pose.X_WM.isApprox(good.X_WM, 0.0));
  }
  EXPECT_TRUE(estimator.step(frame_with(random_pose(random))).valid);
  EXPECT_EQ(estimator.step(hidden).sequence, 9U);
}

TEST(HandPoseFromABody, NeedsNoMarkersAndNoHeap) {
  HandPoseEstimator estimator(BodyPoseConfig{}, Pose::Identity());
  const MarkerFrame frame = frame_with(Pose::Identity());
  const auto before = test::heap_allocations();
  EXPECT_TRUE(estimator.step(frame).valid);
  EXPECT_EQ(test::heap_allocations(), before);
  EXPECT_TRUE(estimator.follows_body());
  EXPECT_FALSE(HandPoseEstimator(paper_glove(), Pose::Identity()).follows_body());
}

TEST(HandPoseFromABody, IsNotUsedUnlessAskedFor) {
  HandPoseEstimator estimator(paper_glove(), paper_calibration());
  EXPECT_FALSE(estimator.step(frame_with(Pose::Identity())).valid) << "the triad is missing";
}

}  // namespace
}  // namespace embody::hand
