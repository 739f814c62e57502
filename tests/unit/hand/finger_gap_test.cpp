// Markers that vanish and return: no jump, whatever vanishes, and a finger without markers is held, then let go.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "core/hand/finger_estimator.hpp"
#include "core/hand/hand_data.hpp"
#include "core/hand/hand_pose_estimator.hpp"
#include "core/hand/synthetic_motion.hpp"
#include "tests/unit/hand/real_recording.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::hand {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;
constexpr Duration kPeriod = std::chrono::milliseconds(10);

Vector9 angles(const HandState& state, std::size_t finger) {
  return state.q_rad.segment<9>(static_cast<Eigen::Index>(kFingerOffset[finger]));
}

/// Largest relative rotation of the finger's joints between two states, rad.
double joint_step(const HandState& a, const HandState& b, std::size_t finger) {
  double step = 0.0;
  for (Eigen::Index j = 0; j < 3; ++j) {
    step = std::max(step, math::angle_between(math::exp_so3(angles(a, finger).segment<3>(3 * j)),
                                              math::exp_so3(angles(b, finger).segment<3>(3 * j))));
  }
  return step;
}

std::vector<MarkerFrame> synthetic_frames() {
  const SyntheticMotion motion({100.0, 15.0, 1});
  std::vector<MarkerFrame> frames;
  for (std::size_t k = 0; k < motion.frame_count(); ++k) frames.push_back(motion.frame(k).markers);
  return frames;
}

std::vector<MarkerFrame> real_frames() {
  auto frames = test::read_recording(EMBODY_SOURCE_DIR "/../shared/data/small_pillow.tsv", paper_glove());
  for (std::size_t k = 0; k < frames.size(); ++k) frames[k].t_capture = TimePoint{kPeriod * (k + 1)};
  return frames;
}

/// Hides the markers of `slots` for 1 to 60 frames, again and again.
void make_gaps(std::vector<MarkerFrame>& frames, const std::vector<std::size_t>& slots, std::uint64_t seed) {
  test::RandomValues random(seed);
  for (std::size_t k = 20; k < frames.size();) {
    const auto length = static_cast<std::size_t>(random(1.0, 61.0));
    for (std::size_t i = k; i < std::min(frames.size(), k + length); ++i) {
      for (const std::size_t slot : slots) frames[i].markers[slot].visible = false;
    }
    k += length + static_cast<std::size_t>(random(5.0, 60.0));
  }
}

/// Largest joint step in the frames in which a marker of the finger vanished or returned.
double largest_transition_step(const std::vector<MarkerFrame>& frames, std::size_t finger) {
  HandPoseEstimator hand(paper_glove(), paper_calibration());
  FingerEstimator fingers(HandModel{}, paper_glove(), {});
  HandState last, state;
  double largest = 0.0;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    fingers.step(frames[k], hand.step(frames[k]), state);
    bool changed = state.visible_markers[finger] != last.visible_markers[finger];  // some are believed later than seen
    for (std::size_t slot = 3 + 2 * finger; k > 0 && slot < 5 + 2 * finger; ++slot) {
      changed |= frames[k].markers[slot].visible != frames[k - 1].markers[slot].visible;
    }
    if (k > 0 && changed) largest = std::max(largest, joint_step(last, state, finger));
    last = state;
  }
  return largest;
}

/// A frame that shows the tip of the index finger only, bent as `q`.
MarkerFrame tip_only(const HandModel& model, const Vector9& q, std::uint64_t number) {
  constexpr std::size_t kIndexTip = 5;
  MarkerFrame frame;
  frame.frame_number = number;
  frame.t_capture = TimePoint{kPeriod * number};
  frame.count = 13;
  frame.markers[kIndexTip] = {model.finger_points(Finger::kIndex, q)[0], true};
  return frame;
}

// A tip on the way between knuckle and full reach is reached with the middle joint bent either way. An overstretched
// finger that bends must not stay on the wrong side; the way back is no jump.
TEST(FingerFold, OfAFingerThatWasOverstretchedIsFoundAgain) {
  test::RandomValues random(61);
  HandPose here;
  here.valid = true;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const HandData data = builtin_hand(Skeleton::kBoneLengths, side);
    const HandModel model(data, Shape::Zero(), default_points(data));
    const double sign = side == Side::kRight ? 1.0 : -1.0;
    for (int i = 0; i < 20; ++i) {
      FingerEstimator fingers(model, paper_glove(), {});
      Vector9 from = Vector9::Zero(), to = Vector9::Zero();
      from(2) = sign * 1.2, from(5) = -sign * .1, from(8) = -sign * .15;
      to(2) = sign * random(.3, .6), to(5) = sign * random(.7, 1.1), to(8) = to(5) * 2.0 / 3.0;
      HandState last, state;
      std::uint64_t number = 1;
      for (int k = 0; k < 20; ++k) fingers.step(tip_only(model, from, number++), here, last);
      constexpr int kMoving = 40;
      for (int k = 0; k < kMoving + 60; ++k) {
        const double share = std::min(1.0, static_cast<double>(k) / kMoving);
        fingers.step(tip_only(model, (1.0 - share) * from + share * to, number++), here, state);
        ASSERT_LE(joint_step(last, state, 1), 5.0 * kDegree + 1e-9) << i << " " << k;
        last = state;
      }
      EXPECT_NEAR(sign * angles(state, 1)(5), sign * to(5), .25) << i;
      EXPECT_LT(state.residual_m[1], 2e-3) << i;
    }
  }
}

TEST(FingerGaps, NeverMakeAJointJumpByMoreThanFiveDegrees) {
  std::vector<std::vector<MarkerFrame>> recordings{synthetic_frames()};
  if (auto real = real_frames(); !real.empty()) recordings.push_back(std::move(real));
  for (const auto& recording : recordings) {
    for (std::size_t finger = 0; finger < kFingers; ++finger) {
      const std::size_t tip = 3 + 2 * finger, middle = tip + 1;
      for (const std::vector<std::size_t>& lost : {std::vector{tip}, std::vector{middle}, std::vector{tip, middle}}) {
        auto frames = recording;
        make_gaps(frames, lost, /*seed=*/70 + finger);
        EXPECT_LE(largest_transition_step(frames, finger) / kDegree, 5.0)
            << kFingerNames[finger] << " loses " << lost.size() << " from slot " << lost[0] << " in "
            << recording.size() << " frames";
      }
    }
  }
}

TEST(FingerGaps, AreForgottenSoonAfterTheMarkersReturn) {
  const auto whole = synthetic_frames();
  for (std::size_t finger = 0; finger < kFingers; ++finger) {
    auto frames = whole;
    for (std::size_t k = 300; k < 350; ++k) {
      for (const std::size_t slot : {3 + 2 * finger, 4 + 2 * finger}) frames[k].markers[slot].visible = false;
    }
    HandPoseEstimator hand(paper_glove(), paper_calibration());
    FingerEstimator with_gap(HandModel{}, paper_glove(), {}), without(HandModel{}, paper_glove(), {});
    HandState a, b;
    for (std::size_t k = 0; k < 400; ++k) {
      const HandPose pose = hand.step(whole[k]);
      with_gap.step(frames[k], pose, a);
      without.step(whole[k], pose, b);
    }
    EXPECT_LT((a.p_M[finger][0] - b.p_M[finger][0]).norm(), 2e-3) << kFingerNames[finger];
  }
}

TEST(FingerWithoutMarkers, IsHeldThenDecaysToTheFlatHandAndSaysSo) {
  auto frames = synthetic_frames();
  HandPoseEstimator hand(paper_glove(), paper_calibration());
  const FingerEstimatorConfig config;
  FingerEstimator fingers(HandModel{}, paper_glove(), config);
  HandState state;
  std::size_t k = 0;
  for (; k < 500; ++k) fingers.step(frames[k], hand.step(frames[k]), state);
  const HandState before = state;
  double last_norm = angles(before, 2).norm();
  ASSERT_GT(last_norm, 0.3) << "the hand is closed";
  for (Duration unseen = kPeriod; k < frames.size(); ++k, unseen += kPeriod) {
    frames[k].markers[7].visible = frames[k].markers[8].visible = false;
    fingers.step(frames[k], hand.step(frames[k]), state);
    const double norm = angles(state, 2).norm();
    if (unseen <= config.hold) {
      ASSERT_EQ(state.quality[2], FingerQuality::kHeld);
      ASSERT_EQ(angles(state, 2), angles(before, 2));
    } else {
      ASSERT_EQ(state.quality[2], FingerQuality::kLost);
      ASSERT_LT(norm, last_norm);
      ASSERT_LT(last_norm - norm, 0.05) << "slowly";
    }
    last_norm = norm;
  }
  EXPECT_LT(last_norm, 1e-3) << "flat in the end";
}

TEST(FingerEstimator, HasNoDeadBandOnARealRecording) {
  const auto frames = real_frames();
  if (frames.empty()) GTEST_SKIP() << "the real recording ../shared/data/small_pillow.tsv is not here";
  HandPoseEstimator hand(paper_glove(), paper_calibration());
  FingerEstimator fingers(HandModel{}, paper_glove(), {});
  HandState last, state;
  Pose X_MW_last;
  std::size_t finger_frames = 0, frozen = 0;
  std::vector<double> steps;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const HandPose pose = hand.step(frames[k]);
    const Pose X_MW = pose.X_WM.inverse();
    fingers.step(frames[k], pose, state);
    for (std::size_t f = 0; k > 0 && f < kFingers; ++f) {
      steps.push_back(joint_step(last, state, f));
      const Marker &tip = frames[k].markers[3 + 2 * f], &tip_last = frames[k - 1].markers[3 + 2 * f];
      if (!tip.visible || !tip_last.visible) continue;
      ++finger_frames;
      const double marker_m = (X_MW * tip.p_W - X_MW_last * tip_last.p_W).norm();
      const double model_m = (state.p_M[f][0] - last.p_M[f][0]).norm();
      frozen += marker_m > 1e-3 && model_m < 1e-4 && state.quality[f] != FingerQuality::kAtLimit;
    }
    last = state;
    X_MW_last = X_MW;
  }
  std::sort(steps.begin(), steps.end());
  RecordProperty("frozen", static_cast<int>(frozen));
  EXPECT_LT(static_cast<double>(frozen), 0.001 * static_cast<double>(finger_frames));
  EXPECT_LE(steps[steps.size() * 99 / 100] / kDegree, 5.0);
}

}  // namespace
}  // namespace embody::hand
