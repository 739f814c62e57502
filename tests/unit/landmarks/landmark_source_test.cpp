// The simulated landmark tracker's tables and motion, and the record mapping on a real table.
#include "daemon/simlab/landmark_source.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/hand/finger_estimator.hpp"
#include "core/hand/landmark_layout.hpp"
#include "core/hand/palm_pose_estimator.hpp"
#include "core/hand/synthetic_motion.hpp"

namespace embody::sim {
namespace {

using hand::kLandmarkNames;
using hand::kLandmarks;

/// A table of one frame; `cell` makes the text of landmark i, axis k.
template <class Cell>
std::string table(const Cell& cell, const std::string& more_columns = "", const std::string& more_cells = "") {
  std::string header = "frame";
  std::string row = "0";
  for (std::size_t i = 0; i < kLandmarks; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      header += std::string(",") + kLandmarkNames[i] + "_" + "xyz"[k] + "_m";
      row += "," + cell(i, k);
    }
  }
  return header + more_columns + "\n" + row + more_cells + "\n";
}

std::string some_cell(std::size_t i, std::size_t k) {
  return std::to_string(0.01 * static_cast<double>(i) + 0.001 * static_cast<double>(k));
}

/// The frame as the landmark driver gives it.
MarkerFrame marker_frame(const landmarks::LandmarkFrame& in, std::size_t k, double rate_hz) {
  MarkerFrame frame;
  frame.frame_number = k + 1;
  frame.t_capture = frame.t_arrival = TimePoint{from_seconds(static_cast<double>(k + 1) / rate_hz)};
  frame.count = kLandmarks;
  for (std::size_t i = 0; i < kLandmarks; ++i) {
    const auto& p = in.landmarks[i].p_W;
    frame.markers[i] = {{p[0], p[1], p[2]}, in.landmarks[i].confidence > 0.0F, in.landmarks[i].confidence};
  }
  return frame;
}

TEST(LandmarkTable, IsReadByColumnName) {
  const auto frames = parse_landmarks(table(some_cell, ",note,index_tip_confidence", ",hello,0.25"), "t");
  ASSERT_TRUE(frames.ok()) << frames.error().detail.view();
  ASSERT_EQ(frames->size(), 1U);
  for (std::size_t i = 0; i < kLandmarks; ++i) {
    EXPECT_EQ((*frames)[0].landmarks[i].confidence, i == 8 ? 0.25F : 1.0F) << i;
    EXPECT_NEAR((*frames)[0].landmarks[i].p_W[2], 0.01 * static_cast<double>(i) + 0.002, 1e-6) << i;
  }
}

TEST(LandmarkTable, TakesEmptyCellsAndNanAsNotSeen) {
  for (const char* gap : {"", "nan", " "}) {
    const auto frames = parse_landmarks(
        table([gap](std::size_t i, std::size_t k) { return i == 4 && k == 1 ? gap : some_cell(i, k); }), "t");
    ASSERT_TRUE(frames.ok()) << frames.error().detail.view();
    EXPECT_EQ((*frames)[0].landmarks[4].confidence, 0.0F);
    EXPECT_EQ((*frames)[0].landmarks[4].p_W[0], 0.0F);
    EXPECT_TRUE(landmarks::decode(landmarks::encode((*frames)[0])).ok()) << "a valid datagram all the same";
  }
}

TEST(LandmarkTable, SaysWhereItIsWrong) {
  const std::string good = table(some_cell);
  const auto cell_4_1 = [](const char* text) {
    return table([text](std::size_t i, std::size_t k) { return i == 4 && k == 1 ? text : some_cell(i, k); });
  };
  std::string renamed = good;
  renamed.replace(renamed.find("ring_dip_y_m"), 12, "ring_dip_q_m");
  const std::pair<std::string, const char*> cases[] = {
      {"", "t:1: there is no column wrist_x_m"},
      {renamed, "t:1: there is no column ring_dip_y_m"},
      {table(some_cell, ",wrist_x_m", ",0"), "t:1: two columns are named wrist_x_m"},
      {good.substr(0, good.find('\n') + 1), "t:2: there is no frame"},
      {good + "1,0,0\n", "t:3: 3 columns, the header has 64"},
      {cell_4_1("abc"), "t:2: column 15 is no number within 10"},
      {cell_4_1("inf"), "t:2: column 15 is no number within 10"},
      {cell_4_1("-10.5"), "t:2: column 15 is no number within 10"},
      {table(some_cell, ",wrist_confidence", ",1.5"), "t:2: column 65 is no number within 1"}};
  for (const auto& [text, message] : cases) {
    const auto frames = parse_landmarks(text, "t");
    ASSERT_FALSE(frames.ok()) << message;
    EXPECT_EQ(frames.error().detail.view(), message);
  }
}

TEST(LandmarkTable, BearsAnyBytes) {
  const std::string good = table(some_cell);
  std::uint64_t state = 1;  // linear congruential (Knuth, MMIX)
  const auto random = [&state] { return (state = state * 6364136223846793005ULL + 1442695040888963407ULL) >> 33; };
  for (int i = 0; i < 3000; ++i) {
    std::string text = good;
    for (int k = 0; k < 3; ++k) text[random() % text.size()] = static_cast<char>(random());
    const auto frames = parse_landmarks(text, "t");
    if (!frames) continue;
    for (const auto& frame : *frames) ASSERT_TRUE(landmarks::decode(landmarks::encode(frame)).ok()) << i;
  }
}

TEST(LandmarkMotion, IsEstimatedAsItWasMade) {
  constexpr double kRate = 30.0;
  const auto frames = make_landmarks(kRate, 15.0, 1);
  ASSERT_EQ(frames.size(), 450U);
  const hand::HandData data = hand::builtin_hand(hand::Skeleton::kBoneLengths, Side::kRight);
  const hand::HandModel model(data, hand::Shape::Zero(), hand::landmark_points(data));
  const hand::SyntheticMotion truth({kRate, 15.0, 1});
  hand::PalmPoseEstimator palm(model);
  hand::FingerEstimator fingers(model, hand::landmark_layout(), hand::FingerEstimatorConfig{});
  HandState state;
  double sum_m = 0.0;
  double worst_m = 0.0;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const MarkerFrame frame = marker_frame(frames[k], k, kRate);
    const HandPose pose = palm.step(frame);
    ASSERT_TRUE(pose.valid) << k;
    ASSERT_LT(pose.fit_error_m, 0.006) << k;
    fingers.step(frame, pose, state);
    const hand::SyntheticFrame made = truth.frame(k);
    const auto p_M = hand::landmark_positions(model, made.q_rad);
    const auto found_M = hand::landmark_positions(model, state.q_rad);
    double frame_m = 0.0;
    for (std::size_t i = 0; i < kLandmarks; ++i) frame_m += (state.X_WM * found_M[i] - made.X_WM * p_M[i]).norm();
    sum_m += frame_m / kLandmarks;
    worst_m = std::max(worst_m, frame_m / kLandmarks);
  }
  std::printf("landmarks %.1f mm from the truth on average, %.1f mm in the worst frame\n",
              1e3 * sum_m / static_cast<double>(frames.size()), 1e3 * worst_m);
  EXPECT_LT(sum_m / static_cast<double>(frames.size()), 0.003);
  EXPECT_NEAR(palm.palm_scale(), 1.0, 0.02);
}

/// The value below which `share` of the values are.
double quantile(std::vector<double> values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

TEST(RealLandmarks, GiveAPoseInEveryFrameAndFingersWithinTheirBounds) {
  constexpr double kRate = 30.0;
  const auto frames = load_landmarks(EMBODY_SOURCE_DIR "/../shared/data/landmarks_video.csv");
  if (!frames) GTEST_SKIP() << "the real landmarks are not here: " << frames.error().detail.view();
  const hand::HandData data = hand::builtin_hand(hand::Skeleton::kBoneLengths, Side::kRight);
  const hand::HandModel model(data, hand::Shape::Zero(), hand::landmark_points(data));
  const hand::FingerEstimatorConfig config;
  hand::PalmPoseEstimator palm(model);
  hand::FingerEstimator fingers(model, hand::landmark_layout(), config);
  HandState state;
  std::vector<double> fit_mm;
  std::array<double, kFingers> residual_mm{};
  for (std::size_t k = 0; k < frames->size(); ++k) {
    const MarkerFrame frame = marker_frame((*frames)[k], k, kRate);
    const HandPose pose = palm.step(frame);
    ASSERT_TRUE(pose.valid) << k;
    fit_mm.push_back(1e3 * pose.fit_error_m);
    fingers.step(frame, pose, state);
    ASSERT_TRUE(state.q_rad.allFinite() && math::is_valid(state.X_WM)) << k;
    for (std::size_t f = 0; f < kFingers; ++f) {
      const hand::Vector9 q = state.q_rad.segment<9>(static_cast<Eigen::Index>(kFingerOffset[f]));
      ASSERT_GE((q - config.lower_rad[f]).minCoeff(), -1e-12) << kFingerNames[f] << " in frame " << k;
      ASSERT_GE((config.upper_rad[f] - q).minCoeff(), -1e-12) << kFingerNames[f] << " in frame " << k;
      ASSERT_TRUE(state.p_M[f][0].allFinite() && state.p_M[f][1].allFinite());
      residual_mm[f] += 1e3 * state.residual_m[f] / static_cast<double>(frames->size());
    }
  }
  std::printf("palm fit %.1f mm (median), %.1f mm (99 %%); palm scale %.3f\n", quantile(fit_mm, 0.5),
              quantile(fit_mm, 0.99), palm.palm_scale());
  for (std::size_t f = 0; f < kFingers; ++f) std::printf("%s: residual %.1f mm\n", kFingerNames[f], residual_mm[f]);
  EXPECT_LT(quantile(fit_mm, 0.99), 15.0);
  EXPECT_NEAR(palm.palm_scale(), 1.0, 0.15);
  for (std::size_t f = 0; f < kFingers; ++f) EXPECT_LT(residual_mm[f], 20.0) << kFingerNames[f];
}

}  // namespace
}  // namespace embody::sim
