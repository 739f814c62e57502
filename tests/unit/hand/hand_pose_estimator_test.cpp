#include "core/hand/hand_pose_estimator.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/heap_counter.hpp"
#include "tests/unit/hand/real_recording.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::hand {
namespace {

using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(PaperGlove, NamesThirteenMarkersThreeOfThemOnTheBackOfTheHand) {
  const GloveLayout glove = paper_glove();
  ASSERT_EQ(glove.names.size(), 13u);
  EXPECT_EQ(glove.names[glove.back_slots[0]].view(), "hand_top");
  EXPECT_EQ(glove.names[glove.back_slots[1]].view(), "hand_left");
  EXPECT_EQ(glove.names[glove.back_slots[2]].view(), "hand_right");
  ASSERT_EQ(glove.finger_markers.size(), 10u);
  for (const FingerMarker& marker : glove.finger_markers) {
    const std::string finger = kFingerNames[static_cast<std::size_t>(marker.finger)];
    EXPECT_EQ(glove.names[marker.slot].view(), finger + (marker.point == 0 ? "_tip" : "_middle"));
  }
}

TEST(HandPoseEstimator, ReproducesThePublishedPoseOfARealFrame) {
  const MarkerFrame frame = test::first_real_frame();
  HandPoseEstimator estimator(paper_glove(), paper_calibration());
  const HandPose pose = estimator.step(frame);
  ASSERT_TRUE(pose.valid);
  EXPECT_LT((pose.X_WM.translation() - Vector3d(.16380, .15317, .43737)).cwiseAbs().maxCoeff(), 1e-5);
  const Vector3d p_M_index_tip = pose.X_WM.inverse() * frame.markers[5].p_W;
  EXPECT_LT((p_M_index_tip - Vector3d(-.07611, .04046, .02262)).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_EQ(pose.sequence, 1u);
  EXPECT_EQ(pose.frame_number, frame.frame_number);
  EXPECT_EQ(pose.t_capture, frame.t_capture);
  EXPECT_EQ(pose.t_arrival, frame.t_arrival);
}

TEST(HandFrame, HasItsAxesWhereThePaperPutsThem) {
  test::RandomValues random(31);
  for (int i = 0; i < 2'000; ++i) {
    const Vector3d top = random.vector<3>(-1.0, 1.0), left = random.vector<3>(-1.0, 1.0);
    const Vector3d right = random.vector<3>(-1.0, 1.0);
    Pose X_WH = Pose::Identity();
    ASSERT_TRUE(hand_frame(top, left, right, X_WH)) << "triad " << i;
    ASSERT_TRUE(math::is_valid(X_WH));
    ASSERT_EQ(X_WH.translation(), right);
    const Vector3d top_H = X_WH.inverse() * top, left_H = X_WH.inverse() * left;
    ASSERT_LT(top_H.head<2>().norm(), 1e-12) << "z runs from the right to the top marker";
    ASSERT_GT(top_H.z(), 0.0);
    ASSERT_NEAR(left_H.y(), 0.0, 1e-12) << "y is normal to the plane of the markers";
    ASSERT_GT(left_H.x(), 0.0) << "y = z x (left - right)";
  }
}

TEST(HandFrame, MovesWithTheHand) {
  test::RandomValues random(32);
  for (int i = 0; i < 2'000; ++i) {
    const Vector3d top = random.vector<3>(-1.0, 1.0), left = random.vector<3>(-1.0, 1.0);
    const Vector3d right = random.vector<3>(-1.0, 1.0);
    const Pose X_VW = math::pose_from(random.vector<3>(-2.0, 2.0), random.rotation(3.0));
    Pose X_WH = Pose::Identity(), X_VH = Pose::Identity();
    ASSERT_TRUE(hand_frame(top, left, right, X_WH));
    ASSERT_TRUE(hand_frame(X_VW * top, X_VW * left, X_VW * right, X_VH));
    ASSERT_TRUE(X_VH.isApprox(X_VW * X_WH, 1e-9)) << "triad " << i;
  }
}

TEST(HandFrame, RefusesTriadsThatSpanNoPlane) {
  const Vector3d right(.1, .2, .3), along(.03, .01, -.02), other(.0, .04, .01);
  const struct {
    const char* what;
    Vector3d top, left, right;
  } cases[] = {
      {"all coincide", right, right, right},
      {"top on right", right, right + along, right},
      {"left on right", right + along, right, right},
      {"top on left", right + along, right + along, right},
      {"collinear", right + along, right + 2.0 * along, right},
      {"collinear, opposite", right + along, right - along, right},
      {"almost collinear", right + along, right + 2.0 * along + 1e-4 * other, right},
      {"not a number", Vector3d(kNan, 0, 0), right + other, right},
      {"infinite", Vector3d(kInfinity, 0, 0), right + other, right},
      {"infinite origin", right + along, right + other, Vector3d(0, kInfinity, 0)},
      {"overflowing edges", Vector3d(1e200, 0, 0), Vector3d(0, 1e200, 0), right},
      {"overflowing normal", Vector3d(1e150, 0, 0), Vector3d(0, 1e150, 0), right},
  };
  for (const auto& c : cases) {
    Pose X_WH = math::pose_from({1, 2, 3}, {.1, .2, .3});
    const Pose before = X_WH;
    EXPECT_FALSE(hand_frame(c.top, c.left, c.right, X_WH)) << c.what;
    EXPECT_EQ(X_WH.matrix(), before.matrix()) << c.what;
  }
}

TEST(HandPoseEstimator, KeepsTheLastPoseAndSaysSoWhenAMarkerOfTheTriadIsMissing) {
  const MarkerFrame good = test::first_real_frame();
  for (std::size_t missing = 0; missing < 3; ++missing) {
    HandPoseEstimator estimator(paper_glove(), paper_calibration());
    const HandPose before = estimator.step(good);
    MarkerFrame frame = good;
    frame.frame_number = 2;
    frame.t_capture += std::chrono::milliseconds(10);
    frame.markers[missing].visible = false;
    frame.markers[missing].p_W.setConstant(kNan);
    const HandPose pose = estimator.step(frame);
    EXPECT_FALSE(pose.valid);
    EXPECT_EQ(pose.X_WM.matrix(), before.X_WM.matrix());
    EXPECT_EQ(pose.X_WH.matrix(), before.X_WH.matrix());
    EXPECT_EQ(pose.sequence, 2u);
    EXPECT_EQ(pose.frame_number, 2u);
    EXPECT_EQ(pose.t_capture, frame.t_capture);
    EXPECT_TRUE(estimator.step(good).valid) << "valid again as soon as the triad is back";
  }
}

TEST(HandPoseEstimator, IsNotValidForFramesThatAreShorterThanTheGlove) {
  HandPoseEstimator estimator(paper_glove(), paper_calibration());
  MarkerFrame frame = test::first_real_frame();
  frame.count = 2;
  EXPECT_FALSE(estimator.step(frame).valid);
  GloveLayout absurd = paper_glove();
  absurd.back_slots[1] = 1'000'000;
  frame.count = 13;
  EXPECT_FALSE(HandPoseEstimator(absurd, paper_calibration()).step(frame).valid);
  frame.count = 2'000'000;
  EXPECT_FALSE(HandPoseEstimator(absurd, paper_calibration()).step(frame).valid);
}

GloveLayout glove_with_edges() {
  GloveLayout glove = paper_glove();
  const MarkerFrame frame = test::first_real_frame();
  const auto edge = [&](std::size_t i, std::size_t j) { return (frame.markers[i].p_W - frame.markers[j].p_W).norm(); };
  glove.back_edges_m = {edge(0, 1), edge(0, 2), edge(1, 2)};
  return glove;
}

TEST(HandPoseEstimator, SaysHowFarTheTriadIsFromItsKnownShape) {
  HandPoseEstimator estimator(glove_with_edges(), paper_calibration());
  MarkerFrame frame = test::first_real_frame();
  EXPECT_LT(estimator.step(frame).fit_error_m, 1e-9);
  frame.markers[0].p_W += .002 * (frame.markers[0].p_W - frame.markers[2].p_W).normalized();
  const HandPose pose = estimator.step(frame);
  EXPECT_TRUE(pose.valid);
  EXPECT_GT(pose.fit_error_m, .001);
  EXPECT_LT(pose.fit_error_m, .002);
  EXPECT_EQ(HandPoseEstimator(paper_glove(), paper_calibration()).step(frame).fit_error_m, 0.0) << "still learning";
}

TEST(HandPoseEstimator, MakesTheSamePoseFromExchangedLabels) {
  const MarkerFrame good = test::first_real_frame();
  HandPoseEstimator estimator(glove_with_edges(), paper_calibration());
  const HandPose expected = estimator.step(good);
  for (const auto& [a, b] : {std::pair{0, 1}, std::pair{0, 2}, std::pair{1, 2}}) {
    MarkerFrame frame = good;
    std::swap(frame.markers[static_cast<std::size_t>(a)], frame.markers[static_cast<std::size_t>(b)]);
    const HandPose pose = estimator.step(frame);
    EXPECT_TRUE(pose.valid);
    EXPECT_EQ(estimator.triad().state(), TriadState::kRelabelled);
    EXPECT_EQ(pose.X_WM.matrix(), expected.X_WM.matrix()) << a << " and " << b;
  }
}

TEST(HandPoseEstimator, KeepsTheLastPoseWhenTheTriadIsNotTheKnownOne) {
  const MarkerFrame good = test::first_real_frame();
  HandPoseEstimator estimator(glove_with_edges(), paper_calibration());
  const HandPose before = estimator.step(good);
  MarkerFrame frame = good;
  frame.markers[1].p_W.y() += .02;
  for (int i = 1; i <= 150; ++i) {
    const HandPose pose = estimator.step(frame);
    ASSERT_FALSE(pose.valid);
    ASSERT_EQ(pose.X_WM.matrix(), before.X_WM.matrix());
    ASSERT_GT(pose.fit_error_m, .004);
    ASSERT_EQ(estimator.triad().state(), i < 100 ? TriadState::kWrong : TriadState::kChanged);
  }
  EXPECT_TRUE(estimator.step(good).valid);
  frame.markers[1].visible = false;
  EXPECT_FALSE(estimator.step(frame).valid);
  EXPECT_EQ(estimator.triad().state(), TriadState::kMissing);
}

TEST(HandPoseEstimator, DoesNotTouchTheHeap) {
  const MarkerFrame frame = test::first_real_frame();
  HandPoseEstimator estimator(paper_glove(), paper_calibration());
  const std::uint64_t before = test::heap_allocations();
  for (int i = 0; i < 100; ++i) (void)estimator.step(frame);
  EXPECT_EQ(test::heap_allocations(), before);
}

TEST(HandPoseEstimator, SeesTheKnownJumpOfTheRealRecordingAndNoGreaterOne) {
  const auto frames = test::read_recording(EMBODY_SOURCE_DIR "/../shared/data/small_pillow.tsv", paper_glove());
  if (frames.empty()) GTEST_SKIP() << "the real recording ../shared/data/small_pillow.tsv is not here";
  HandPoseEstimator estimator(paper_glove(), paper_calibration());
  Pose last = estimator.step(frames[0]).X_WH;
  double greatest_rad = 0.0;
  std::size_t where = 0;
  for (std::size_t k = 1; k < frames.size(); ++k) {
    const HandPose pose = estimator.step(frames[k]);
    ASSERT_TRUE(pose.valid) << "frame " << k + 1;
    const double step_rad = math::angle_between(last.linear(), pose.X_WH.linear());
    if (step_rad > greatest_rad) greatest_rad = step_rad, where = k + 1;
    last = pose.X_WH;
  }
  EXPECT_EQ(where, 4u);
  EXPECT_NEAR(greatest_rad * 180.0 / 3.14159265358979, 4.65, 0.01);
}

}  // namespace
}  // namespace embody::hand
