// The hand pose from the palm's landmarks, and the finger estimator on the other landmarks.
#include "core/hand/palm_pose_estimator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "core/hand/finger_estimator.hpp"
#include "tests/support/heap_counter.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::hand {
namespace {

using Eigen::Vector3d;
using test::RandomValues;

HandModel landmark_model(Side side = Side::kRight, const Shape& shape = Shape::Zero()) {
  const HandData data = builtin_hand(Skeleton::kBoneLengths, side);
  return {data, shape, landmark_points(data)};
}

Pose random_pose(RandomValues& random) {
  return math::pose_from(random.vector<3>(-1.0, 1.0), random.rotation(3.1));
}

/// Bent fingers of a right hand; the thumb moves a little about all axes.
FingerAngles random_grip(RandomValues& random) {
  FingerAngles q = FingerAngles::Zero();
  for (std::size_t f = 1; f < kFingers; ++f) {
    const auto first = static_cast<Eigen::Index>(kFingerOffset[f]);
    q(first + 1) = random(-0.1, 0.1);
    q(first + 2) = random(0.0, 1.0);
    q(first + 5) = random(0.1, 1.1);
    q(first + 8) = 2.0 / 3.0 * q(first + 5);
  }
  q.tail<9>() = random.vector<9>(-0.1, 0.1);
  return q;
}

MarkerFrame frame_of(const HandModel& model, const Pose& X_WM, const FingerAngles& q) {
  MarkerFrame frame;
  frame.frame_number = 1;
  frame.t_capture = frame.t_arrival = TimePoint{std::chrono::seconds(1)};
  frame.count = kLandmarks;
  const auto p_M = landmark_positions(model, q);
  for (std::size_t i = 0; i < kLandmarks; ++i) frame.markers[i] = {X_WM * p_M[i], true};
  return frame;
}

void add_noise(MarkerFrame& frame, RandomValues& random, double most_m) {
  for (std::size_t i = 0; i < kLandmarks; ++i) frame.markers[i].p_W += random.vector<3>(-most_m, most_m);
}

TEST(LandmarkLayout, GivesEverySlotToThePalmOrToOnePointOfAFinger) {
  const GloveLayout layout = landmark_layout();
  ASSERT_EQ(layout.names.size(), kLandmarks);
  std::set<std::size_t> slots;
  for (const PalmLandmark& palm : kPalmLandmarks) EXPECT_TRUE(slots.insert(palm.slot).second) << palm.slot;
  for (const FingerMarker& marker : layout.finger_markers) {
    EXPECT_TRUE(slots.insert(marker.slot).second) << marker.slot;
    EXPECT_EQ(layout.names[marker.slot].view().rfind(kFingerNames[static_cast<std::size_t>(marker.finger)], 0), 0U)
        << "slot " << marker.slot << " carries the name of its finger";
  }
  EXPECT_EQ(slots.size(), kLandmarks);
}

TEST(LandmarkLayout, PointsAreWhereTheModelHasItsLandmarks) {
  RandomValues random(1);
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const HandData data = builtin_hand(Skeleton::kWebXr, side);
    ASSERT_TRUE(check_points(data, landmark_points(data)).ok());
    const HandModel model(data, Shape(random.vector<10>(-0.1, 0.1)), landmark_points(data));
    const FingerAngles q = FingerAngles(random.vector<45>(-0.5, 0.5));
    const auto p_M = landmark_positions(model, q);
    for (const FingerMarker& marker : landmark_layout().finger_markers) {
      const auto first = static_cast<Eigen::Index>(kFingerOffset[static_cast<std::size_t>(marker.finger)]);
      const FingerChain chain = model.chain(marker.finger, q.segment<9>(first));
      EXPECT_LT((model.point(marker.finger, marker.point, chain) - p_M[marker.slot]).norm(), 1e-12) << marker.slot;
    }
    for (const PalmLandmark& palm : kPalmLandmarks) {
      EXPECT_LT((model.rest_joints()[palm.joint] - p_M[palm.slot]).norm(), 1e-12) << palm.slot;
    }
  }
}

TEST(LandmarkLayout, LeavesTheDefaultPointsFirst) {
  const HandData data = builtin_hand(Skeleton::kBoneLengths, Side::kRight);
  const HandPoints defaults = default_points(data);
  const HandPoints points = landmark_points(data);
  for (std::size_t f = 0; f < kFingers; ++f) {
    ASSERT_EQ(points[f].size(), 5U);
    for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(points[f][i].offset_m, defaults[f][i].offset_m);
  }
}

TEST(PalmPose, IsExactForAnyPoseGripShapeAndSide) {
  RandomValues random(2);
  for (int i = 0; i < 1000; ++i) {
    const Side side = i % 2 == 0 ? Side::kRight : Side::kLeft;
    const HandModel model = landmark_model(side, Shape(random.vector<10>(-0.2, 0.2)));
    const Pose X_WM = random_pose(random);
    PalmPoseEstimator estimator(model);
    const HandPose pose = estimator.step(frame_of(model, X_WM, FingerAngles(random.vector<45>(-1.0, 1.0))));
    ASSERT_TRUE(pose.valid) << i;
    ASSERT_TRUE(pose.X_WM.isApprox(X_WM, 1e-9)) << i;
    ASSERT_EQ(pose.X_WH.matrix(), pose.X_WM.matrix());
    ASSERT_LT(pose.fit_error_m, 1e-9);
    ASSERT_EQ(pose.frame_number, 1U);
  }
}

TEST(PalmPose, HoldsForAnyThreeLandmarksThatSpanThePalm) {
  RandomValues random(3);
  const HandModel model = landmark_model();
  int valid = 0;
  for (int mask = 0; mask < 64; ++mask) {
    const Pose X_WM = random_pose(random);
    MarkerFrame frame = frame_of(model, X_WM, FingerAngles::Zero());
    int seen = 0;
    for (std::size_t i = 0; i < kPalmLandmarks.size(); ++i) {
      const bool visible = (mask >> i & 1) != 0;
      frame.markers[kPalmLandmarks[i].slot].visible = visible;
      seen += visible ? 1 : 0;
    }
    PalmPoseEstimator estimator(model);
    const HandPose pose = estimator.step(frame);
    if (seen < 3) {
      EXPECT_FALSE(pose.valid) << mask;
    }
    const bool wrist_and_two_apart = (mask & 0b000001) != 0 && (mask & 0b001100) != 0 && (mask & 0b110000) != 0;
    if (wrist_and_two_apart) {
      EXPECT_TRUE(pose.valid) << mask;
    }
    if (pose.valid) {
      EXPECT_TRUE(pose.X_WM.isApprox(X_WM, 1e-9)) << mask;
    }
    valid += pose.valid ? 1 : 0;
  }
  EXPECT_GT(valid, 20);
}

TEST(PalmPose, RefusesTheFourKnucklesAloneBecauseTheyLieOnALine) {
  const HandModel model = landmark_model();
  MarkerFrame frame = frame_of(model, Pose::Identity(), FingerAngles::Zero());
  frame.markers[0].visible = frame.markers[1].visible = false;
  EXPECT_FALSE(PalmPoseEstimator(model).step(frame).valid);
}

TEST(PalmPose, KeepsTheLastPoseWhenThePalmIsLost) {
  RandomValues random(4);
  const HandModel model = landmark_model();
  const Pose X_WM = random_pose(random);
  PalmPoseEstimator estimator(model);
  EXPECT_TRUE(estimator.step(frame_of(model, X_WM, FingerAngles::Zero())).valid);
  const HandPose lost = estimator.step(MarkerFrame{});
  EXPECT_FALSE(lost.valid);
  EXPECT_TRUE(lost.X_WM.isApprox(X_WM, 1e-9));
  EXPECT_EQ(lost.sequence, 2U);
}

TEST(PalmPose, DoesNotUseLandmarksOfLowConfidenceOrWithoutANumber) {
  RandomValues random(5);
  const HandModel model = landmark_model();
  const Pose X_WM = random_pose(random);
  MarkerFrame frame = frame_of(model, X_WM, FingerAngles::Zero());
  frame.markers[5].p_W += Vector3d(0.5, 0.0, 0.0);
  frame.markers[5].confidence = 0.1F;
  frame.markers[17].p_W.x() = std::nan("");
  frame.markers[13].confidence = std::nanf("");
  const HandPose pose = PalmPoseEstimator(model).step(frame);
  ASSERT_TRUE(pose.valid);
  EXPECT_TRUE(pose.X_WM.isApprox(X_WM, 1e-9));
}

TEST(PalmPose, RefusesWhatDoesNotFitThePalm) {
  const HandModel model = landmark_model();
  MarkerFrame frame = frame_of(model, Pose::Identity(), FingerAngles::Zero());
  frame.markers[9].p_W += Vector3d(0.0, 0.15, 0.0);
  const HandPose pose = PalmPoseEstimator(model).step(frame);
  EXPECT_FALSE(pose.valid);
  EXPECT_GT(pose.fit_error_m, PalmPoseConfig{}.fit_tolerance_m);
}

TEST(PalmPose, FollowsTheLandmarksThatAreMoreCertain) {
  const HandModel model = landmark_model();
  MarkerFrame frame = frame_of(model, Pose::Identity(), FingerAngles::Zero());
  frame.markers[17].p_W += Vector3d(0.0, 0.02, 0.0);
  const auto error_m = [&](float confidence) {
    frame.markers[17].confidence = confidence;
    return (PalmPoseEstimator(model).step(frame).X_WM * model.rest_joints()[4] - model.rest_joints()[4]).norm();
  };
  EXPECT_LT(error_m(0.35F), 0.7 * error_m(1.0F));
}

TEST(PalmPose, StaysWithinAFewMillimetresAndDegreesOfTheTruthUnderNoise) {
  RandomValues random(6);
  const HandModel model = landmark_model();
  double sum_m2 = 0.0;
  double sum_rad2 = 0.0;
  constexpr int kTrials = 2000;
  for (int i = 0; i < kTrials; ++i) {
    const Pose X_WM = random_pose(random);
    MarkerFrame frame = frame_of(model, X_WM, FingerAngles::Zero());
    add_noise(frame, random, 0.005 * std::sqrt(3.0));  // 5 mm standard deviation per axis
    const HandPose pose = PalmPoseEstimator(model).step(frame);
    ASSERT_TRUE(pose.valid) << i;
    sum_m2 += (pose.X_WM * model.rest_joints()[4] - X_WM * model.rest_joints()[4]).squaredNorm();
    sum_rad2 += std::pow(math::angle_between(X_WM.linear(), pose.X_WM.linear()), 2);
  }
  const double rms_mm = 1e3 * std::sqrt(sum_m2 / kTrials);
  const double rms_deg = 180.0 / 3.14159265358979 * std::sqrt(sum_rad2 / kTrials);
  std::printf("5 mm noise per axis: middle knuckle %.1f mm, palm %.1f degrees, root mean square\n", rms_mm, rms_deg);
  EXPECT_LT(rms_mm, 7.0);
  EXPECT_LT(rms_deg, 10.0);
}

TEST(PalmScale, IsTheMedianOfTheFirstSecondAndIsNotApplied) {
  RandomValues random(7);
  const HandModel model = landmark_model();
  Shape large = Shape::Zero();
  large(static_cast<Eigen::Index>(HandShape::kScale)) = 0.12;
  const HandModel person = landmark_model(Side::kRight, large);
  PalmPoseEstimator estimator(model);
  for (int k = 0; k <= 30; ++k) {
    MarkerFrame frame = frame_of(person, random_pose(random), FingerAngles::Zero());
    add_noise(frame, random, 0.003);
    frame.t_capture = TimePoint{std::chrono::milliseconds(1000 + 34 * k)};
    EXPECT_EQ(estimator.palm_scale(), 0.0) << k;
    EXPECT_GT(estimator.step(frame).fit_error_m, 0.002) << "nothing is scaled";
  }
  EXPECT_NEAR(estimator.palm_scale(), 1.12, 0.016);  // four standard deviations of the median
  EXPECT_EQ(PoseEstimator(estimator).palm_scale(), estimator.palm_scale());
  EXPECT_EQ(PoseEstimator(HandPoseEstimator(paper_glove(), paper_calibration())).palm_scale(), 0.0);
}

TEST(PalmScale, IsKnownInBoundedMemoryWhenTimeStandsStill) {
  const HandModel model = landmark_model();
  PalmPoseEstimator estimator(model);
  const MarkerFrame frame = frame_of(model, Pose::Identity(), FingerAngles::Zero());
  for (int k = 0; k < 1000; ++k) (void)estimator.step(frame);
  EXPECT_NEAR(estimator.palm_scale(), 1.0, 1e-9);
}

TEST(Landmarks, GiveBackTheFingersThatMadeThem) {
  RandomValues random(8);
  const HandModel model = landmark_model();
  double worst_m = 0.0;
  for (int i = 0; i < 50; ++i) {
    const FingerAngles q = random_grip(random);
    const Pose X_WM = random_pose(random);
    PalmPoseEstimator palm(model);
    FingerEstimator fingers(model, landmark_layout(), for_landmarks({}));
    HandState state;
    MarkerFrame frame = frame_of(model, X_WM, q);
    for (int k = 0; k < 30; ++k) {  // the prior on steps lets go
      fingers.step(frame, palm.step(frame), state);
      frame.t_capture += std::chrono::milliseconds(33);
    }
    const auto p_M = landmark_positions(model, q);
    const auto found_M = landmark_positions(model, state.q_rad);
    for (std::size_t slot = 0; slot < kLandmarks; ++slot) {
      worst_m = std::max(worst_m, (found_M[slot] - p_M[slot]).norm());
    }
    for (std::size_t f = 0; f < kFingers; ++f) EXPECT_EQ(state.visible_markers[f], 3);
  }
  std::printf("worst landmark %.2f mm from the truth\n", 1e3 * worst_m);
  EXPECT_LT(worst_m, 0.006);
}

TEST(Landmarks, ALandmarkThatIsLessCertainPullsItsFingerLess) {
  const HandModel model = landmark_model();
  MarkerFrame frame = frame_of(model, Pose::Identity(), FingerAngles::Zero());
  frame.markers[8].p_W += Vector3d(0.0, -0.02, 0.0);  // index tip
  const auto angle_rad = [&](float confidence) {
    frame.markers[8].confidence = confidence;
    PalmPoseEstimator palm(model);
    FingerEstimator fingers(model, landmark_layout(), for_landmarks({}));
    HandState state;
    for (int k = 0; k < 30; ++k) fingers.step(frame, palm.step(frame), state);
    return (landmark_positions(model, state.q_rad)[8] - landmark_positions(model, FingerAngles::Zero())[8]).norm();
  };
  EXPECT_LT(angle_rad(0.1F), 0.8 * angle_rad(1.0F));
}

TEST(PalmPose, UsesNoHeap) {
  if (!test::counts_heap()) GTEST_SKIP() << "the sanitizer owns the heap";
  RandomValues random(9);
  const HandModel model = landmark_model();
  PoseEstimator estimator{PalmPoseEstimator(model)};
  MarkerFrame frame = frame_of(model, random_pose(random), FingerAngles::Zero());
  const std::uint64_t before = test::heap_allocations();
  for (int k = 0; k < 100; ++k) {
    frame.markers[0].visible = k % 5 != 0;
    frame.t_capture += std::chrono::milliseconds(33);
    (void)estimator.step(frame);
  }
  EXPECT_EQ(test::heap_allocations(), before);
}

}  // namespace
}  // namespace embody::hand
