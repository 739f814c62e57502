// The record mapping judged on a real recording: calibrated on its first 1,000 frames, measured on the other 2,000.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "core/hand/calibration.hpp"
#include "core/hand/finger_estimator.hpp"
#include "core/hand/hand_pose_estimator.hpp"
#include "tests/unit/hand/real_recording.hpp"

namespace embody::hand {
namespace {

constexpr std::size_t kCalibrationFrames = 1000;

struct Subject {
  std::vector<MarkerFrame> frames;
  Calibration calibration;
  CalibratedGlove glove;
  HandModel model;
};

/// Calibrated once for all tests; nothing without the recording.
const Subject* subject() {
  static const auto kSubject = []() -> std::unique_ptr<Subject> {
    auto frames = test::read_recording(EMBODY_SOURCE_DIR "/../shared/data/small_pillow.tsv", paper_glove());
    for (std::size_t k = 0; k < frames.size(); ++k) {
      frames[k].t_capture = TimePoint{std::chrono::milliseconds(10) * (k + 1)};
    }
    if (frames.size() <= kCalibrationFrames) return nullptr;
    const HandData data = builtin_hand(Skeleton::kBoneLengths, Side::kRight);
    const HandPoints points = default_points(data);
    const std::vector<MarkerFrame> first(frames.begin(), frames.begin() + kCalibrationFrames);
    const auto found = calibrate(first, paper_glove(), data, points, paper_calibration());
    EXPECT_TRUE(found.ok()) << found.error().detail.view();
    if (!found) return nullptr;
    const CalibratedGlove glove = apply(*found, paper_glove(), points);
    return std::make_unique<Subject>(
        Subject{std::move(frames), *found, glove, HandModel(data, found->shape, glove.points)});
  }();
  return kSubject.get();
}

struct Judgement {
  std::array<double, 13> mean_m{};  ///< by slot, over the judged frames
  std::size_t finger_frames{0};
  std::size_t worse_than_reference{0};  ///< cost more than 1 % above SLSQP's
};

/// Fits `fitted` slots in all frames and judges all finger markers in the frames after the calibration's.
Judgement judge(const Subject& subject, const std::vector<std::size_t>& fitted, bool reference) {
  GloveLayout glove = subject.glove.glove;
  glove.finger_markers.clear();
  for (const FingerMarker& marker : subject.glove.glove.finger_markers) {
    if (std::find(fitted.begin(), fitted.end(), marker.slot) != fitted.end()) glove.finger_markers.push_back(marker);
  }
  HandPoseEstimator hand(glove, subject.calibration.X_HM);
  FingerEstimator fingers(subject.model, glove, {});
  Judgement judgement;
  std::array<std::size_t, 13> seen{};
  HandState state;
  for (std::size_t k = 0; k < subject.frames.size(); ++k) {
    const MarkerFrame& frame = subject.frames[k];
    const HandPose pose = hand.step(frame);
    fingers.step(frame, pose, state);
    if (k < kCalibrationFrames || !pose.valid) continue;
    for (const FingerMarker& marker : subject.glove.glove.finger_markers) {
      if (!frame.markers[marker.slot].visible) continue;
      const auto offset = static_cast<Eigen::Index>(kFingerOffset[static_cast<std::size_t>(marker.finger)]);
      const FingerChain chain = subject.model.chain(marker.finger, state.q_rad.segment<9>(offset));
      const Eigen::Vector3d p_W = pose.X_WM * subject.model.point(marker.finger, marker.point, chain);
      judgement.mean_m[marker.slot] += (p_W - frame.markers[marker.slot].p_W).norm();
      ++seen[marker.slot];
    }
    for (std::size_t f = 0; reference && k % 4 == 0 && f < kFingers; ++f) {
      const FingerProblem& problem = fingers.problem(static_cast<Finger>(f));
      if (problem.markers.empty()) continue;
      const double ours = problem.cost(state.q_rad.segment<9>(static_cast<Eigen::Index>(kFingerOffset[f])));
      const double theirs = solve_slsqp(problem, 5000, 1e-15).cost_m2;
      ++judgement.finger_frames;
      judgement.worse_than_reference += std::max(ours, 1e-9) > 1.01 * std::max(theirs, 1e-9);
    }
  }
  for (std::size_t slot = 3; slot < 13; ++slot) judgement.mean_m[slot] /= static_cast<double>(seen[slot]);
  return judgement;
}

constexpr const char* kAbsent = "the real recording ../shared/data/small_pillow.tsv is not here";

TEST(RecordMappingOnARealRecording, FitsTipsWithinTwoAndAllMarkersWithinThreeMillimetres) {
  if (subject() == nullptr) GTEST_SKIP() << kAbsent;
  const Judgement judgement = judge(*subject(), {3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, false);
  for (std::size_t f = 0; f < kFingers; ++f) {
    EXPECT_LE(judgement.mean_m[3 + 2 * f], 2e-3) << kFingerNames[f] << " tip";
    EXPECT_LE(judgement.mean_m[4 + 2 * f], 3e-3) << kFingerNames[f] << " middle";
  }
}

TEST(RecordMappingOnARealRecording, PredictsTheMarkersThatTheFitDidNotSee) {
  if (subject() == nullptr) GTEST_SKIP() << kAbsent;
  const Judgement judgement = judge(*subject(), {3, 4, 5, 6, 7, 9, 11}, false);
  // The published implementation misses them by 5.8, 12.8 and 16.6 mm.
  EXPECT_LE(judgement.mean_m[8], 4e-3) << "middle";
  EXPECT_LE(judgement.mean_m[10], 8e-3) << "ring";
  EXPECT_LE(judgement.mean_m[12], 10e-3) << "little";
}

TEST(RecordMappingOnARealRecording, CostsNoMoreThanSlsqpOnTheSameProblems) {
  if (subject() == nullptr) GTEST_SKIP() << kAbsent;
  const Judgement judgement = judge(*subject(), {3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, true);
  ASSERT_GT(judgement.finger_frames, 2000u);
  EXPECT_LE(static_cast<double>(judgement.worse_than_reference), 0.005 * static_cast<double>(judgement.finger_frames));
}

}  // namespace
}  // namespace embody::hand
