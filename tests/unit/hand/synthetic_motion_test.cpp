#include "core/hand/synthetic_motion.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "core/hand/finger_estimator.hpp"
#include "core/hand/hand_pose_estimator.hpp"
#include "tests/support/heap_counter.hpp"
#include "tests/unit/hand/real_recording.hpp"

namespace embody::hand {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kThumbTip = 3, kRingTip = 9;

std::vector<SyntheticFrame> all_frames(const SyntheticMotion& motion) {
  std::vector<SyntheticFrame> frames;
  for (std::size_t k = 0; k < motion.frame_count(); ++k) frames.push_back(motion.frame(k));
  return frames;
}

// Lengths, in frames, of the stretches in which `slot` is not visible.
std::vector<std::size_t> gaps(const std::vector<SyntheticFrame>& frames, std::size_t slot) {
  std::vector<std::size_t> out;
  bool before = true;
  for (const SyntheticFrame& frame : frames) {
    const bool visible = frame.markers.markers[slot].visible;
    if (!visible && before) out.push_back(0);
    if (!visible) ++out.back();
    before = visible;
  }
  return out;
}

TEST(SyntheticMotion, IsAFunctionOfConfigurationAndFrameIndexOnly) {
  const SyntheticMotion a({100.0, 15.0, 7}), b({100.0, 15.0, 7}), other({100.0, 15.0, 8});
  ASSERT_EQ(a.frame_count(), 1500u);
  bool differs = false;
  for (std::size_t i = 0; i < 1500; ++i) {
    const std::size_t k = 1499 - i;  // any order
    const SyntheticFrame frame = a.frame(k), same = b.frame(k);
    ASSERT_EQ(frame.markers.frame_number, k + 1);
    ASSERT_EQ(frame.markers.count, 13u);
    for (std::size_t slot = 0; slot < 13; ++slot) {
      ASSERT_EQ(frame.markers.markers[slot].p_W, same.markers.markers[slot].p_W);
      ASSERT_EQ(frame.markers.markers[slot].visible, same.markers.markers[slot].visible);
      differs = differs || frame.markers.markers[slot].p_W != other.frame(k).markers.markers[slot].p_W;
    }
  }
  EXPECT_TRUE(differs) << "the seed must matter";
}

TEST(SyntheticMotion, KeepsItsNumbersWithinAMicrometreWithAnyCompiler) {
  // Written down once; a change of model, schedule or random numbers shows here.
  const SyntheticMotion motion({100.0, 15.0, 1});
  const struct {
    std::size_t k, slot;
    Vector3d p_W;
  } golden[] = {{0, 0, {0.1103729, 0.1346178, 0.4604427}},   {0, 5, {0.2309727, 0.1921510, 0.4682955}},
                {170, 2, {0.1783457, 0.1678629, 0.3763045}}, {345, 3, {0.2966917, 0.2469827, 0.1413730}},
                {702, 9, {0.3300098, 0.1638731, 0.3197901}}, {1033, 12, {0.3605189, 0.1815298, 0.2390918}},
                {1499, 1, {0.0634991, 0.1621373, 0.4509492}}};
  for (const auto& expected : golden) {
    const Vector3d p_W = motion.frame(expected.k).markers.markers[expected.slot].p_W;
    EXPECT_LT((p_W - expected.p_W).cwiseAbs().maxCoeff(), 1e-6) << expected.k << " " << expected.slot;
  }
}

TEST(SyntheticMotion, StartsLikeTheRealRecording) {
  const MarkerFrame real = test::first_real_frame();
  const MarkerFrame frame = SyntheticMotion().frame(0).markers;
  for (std::size_t slot = 0; slot < 13; ++slot) {
    EXPECT_LT((frame.markers[slot].p_W - real.markers[slot].p_W).norm(), slot < 3 ? 2e-3 : 20e-3) << slot;
  }
}

TEST(SyntheticMotion, MovesSmoothlyWithinHumanSpeedsAndTheRealVolume) {
  const HandModel model;
  const auto frames = all_frames(SyntheticMotion());
  const Vector3d wrist = model.rest_joints()[0];
  constexpr double kPeriodSeconds = 0.01;
  double speed_m_s = 0.0, turn_rad_s = 0.0, jump_m_s2 = 0.0, tilt_rad = 0.0, finger_rad_s = 0.0;
  Vector3d last_velocity = Vector3d::Zero();
  for (std::size_t k = 1; k < frames.size(); ++k) {
    const Pose &X_a = frames[k - 1].X_WM, &X_b = frames[k].X_WM;
    const Vector3d velocity = (X_b * wrist - X_a * wrist) / kPeriodSeconds;
    speed_m_s = std::max(speed_m_s, velocity.norm());
    jump_m_s2 = std::max(jump_m_s2, (velocity - last_velocity).norm() / kPeriodSeconds);
    turn_rad_s = std::max(turn_rad_s, math::angle_between(X_a.linear(), X_b.linear()) / kPeriodSeconds);
    tilt_rad = std::max(tilt_rad, math::angle_between(frames[0].X_WM.linear(), X_b.linear()));
    finger_rad_s =
        std::max(finger_rad_s, (frames[k].q_rad - frames[k - 1].q_rad).cwiseAbs().maxCoeff() / kPeriodSeconds);
    last_velocity = velocity;
    for (std::size_t slot = 0; slot < 13; ++slot) {
      const Vector3d& p_W = frames[k].markers.markers[slot].p_W;
      ASSERT_TRUE((p_W.array() > Vector3d(.05, .03, .11).array()).all()) << p_W.transpose();
      ASSERT_TRUE((p_W.array() < Vector3d(.46, .34, .49).array()).all()) << p_W.transpose();
    }
  }
  EXPECT_LT(speed_m_s, .36);
  EXPECT_GT(speed_m_s, .30);
  EXPECT_LT(turn_rad_s, 1.05);
  EXPECT_GT(turn_rad_s, .5);
  EXPECT_LT(jump_m_s2, 2.0) << "no jumps of speed";
  EXPECT_LT(tilt_rad, .70);
  EXPECT_LT(finger_rad_s, 3.0);
  EXPECT_GT(finger_rad_s, .5) << "the fingers close";
}

TEST(SyntheticMotion, RepeatsWithoutASeam) {
  const SyntheticMotion motion({100.0, 40.0, 1});
  ASSERT_EQ(motion.frame_count(), 4000u);
  for (std::size_t k = 0; k < 1500; ++k) {
    ASSERT_TRUE(motion.frame(k).X_WM.isApprox(motion.frame(k + 1500).X_WM, 1e-9)) << k;
  }
}

TEST(SyntheticMotion, LosesMarkersAsRealRecordingsDo) {
  const auto frames = all_frames(SyntheticMotion({100.0, 60.0, 1}));
  for (std::size_t slot = 0; slot < 3; ++slot) EXPECT_TRUE(gaps(frames, slot).empty()) << "triad";
  const auto thumb = gaps(frames, kThumbTip);
  EXPECT_EQ(thumb.size(), 8u) << "two in each of the four grasps";
  for (const std::size_t length : thumb) {
    EXPECT_GE(length, 15u);
    EXPECT_LE(length, 58u);
  }
  std::size_t drops = 0;
  for (std::size_t slot = kThumbTip + 1; slot < 13; ++slot) {
    for (const std::size_t length : gaps(frames, slot)) {
      EXPECT_LE(length, 5u);
      ++drops;
    }
  }
  EXPECT_GT(drops, 60u);
}

TEST(SyntheticMotion, CarriesOnePersistentStepOfTheRingTip) {
  const HandModel model;
  const auto frames = all_frames(SyntheticMotion());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const auto q = frames[k].q_rad.segment<9>(static_cast<Eigen::Index>(kFingerOffset[3]));
    const Vector3d true_W = frames[k].X_WM * model.finger_points(Finger::kRing, q)[0];
    const double off_m = (frames[k].markers.markers[kRingTip].p_W - true_W).norm();
    ASSERT_NEAR(off_m, k < 700 ? 0.0 : 8e-3, .25e-3) << "frame " << k;
  }
}

TEST(SyntheticMotion, HasTheTriadOfTheRealGlove) {
  for (const SyntheticFrame& frame : all_frames(SyntheticMotion())) {
    const auto& markers = frame.markers.markers;
    ASSERT_NEAR((markers[0].p_W - markers[1].p_W).norm(), .0552, .25e-3);
    ASSERT_NEAR((markers[0].p_W - markers[2].p_W).norm(), .0447, .25e-3);
    ASSERT_NEAR((markers[1].p_W - markers[2].p_W).norm(), .0324, .25e-3);
  }
}

TEST(SyntheticMotion, LetsTheEstimatorsRecoverTheTruth) {
  const HandModel model;
  HandPoseEstimator hand(paper_glove(), paper_calibration());
  FingerEstimator fingers(model, paper_glove(), {});
  HandState state;
  for (const SyntheticFrame& frame : all_frames(SyntheticMotion())) {
    const HandPose pose = hand.step(frame.markers);
    ASSERT_TRUE(pose.valid);
    ASSERT_LT((pose.X_WH.translation() - frame.X_WH.translation()).norm(), .5e-3);
    ASSERT_LT((pose.X_WM.translation() - frame.X_WM.translation()).norm(), .5e-3);
    ASSERT_LT(math::angle_between(pose.X_WM.linear(), frame.X_WM.linear()), 6e-3);
    fingers.step(frame.markers, pose, state);
    for (std::size_t f = 1; f < kFingers; ++f) {
      if (f == 3 || state.visible_markers[f] < 2) continue;
      ASSERT_LT(state.residual_m[f], 1e-3) << kFingerNames[f] << " frame " << frame.markers.frame_number;
    }
  }
}

TEST(SyntheticMotion, HasNoFramesWithAConfigurationThatMakesNoSense) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -1.0, kNan, kInfinity, 1e12}) {
    EXPECT_EQ(SyntheticMotion({bad, 15.0, 1}).frame_count(), 0u) << bad;
    EXPECT_EQ(SyntheticMotion({100.0, bad, 1}).frame_count(), 0u) << bad;
  }
}

TEST(SyntheticMotion, DoesNotTouchTheHeap) {
  const SyntheticMotion motion;
  const std::uint64_t before = test::heap_allocations();
  for (std::size_t k = 0; k < 50; ++k) (void)motion.frame(k);
  EXPECT_EQ(test::heap_allocations(), before);
}

}  // namespace
}  // namespace embody::hand
