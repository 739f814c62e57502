// The judge of the record mapping, judged on hands whose truth is known.
#include "daemon/evaluate/record_evaluation.hpp"

#include <nlohmann/json.hpp>

#include "daemon/evaluate/record_summary.hpp"
#include "tests/unit/evaluate/synthetic_frames.hpp"

namespace embody::evaluate {
namespace {

using nlohmann::json;
using test::models_of;
using test::synthetic_frames;

/// Closing hand with a gap of the thumb tip.
const std::vector<MarkerFrame>& closing() {
  static const std::vector<MarkerFrame> frames = synthetic_frames(200, 300);
  return frames;
}

RecordSamples samples_of(const OperatorModels& models, const std::vector<MarkerFrame>& frames,
                         const std::vector<std::string>& fit = {}, bool reference = false) {
  EvaluationOptions options;
  options.fit = fit;
  options.reference = reference;
  options.timing = false;
  auto samples = evaluate_record(models, frames, options);
  EXPECT_TRUE(samples.ok()) << samples.error().detail.view();
  return samples.ok() ? *samples : RecordSamples{};
}

TEST(Quantile, IsTheSmallestValueThatTheShareDoesNotExceed) {
  EXPECT_EQ(quantile({}, 0.5), std::nullopt);
  EXPECT_EQ(quantile({3.0}, 0.0), 3.0);
  EXPECT_EQ(quantile({3.0}, 1.0), 3.0);
  EXPECT_EQ(quantile({4.0, 1.0, 3.0, 2.0}, 0.5), 2.0);
  std::vector<double> values;
  for (int i = 1000; i >= 1; --i) values.push_back(i);
  EXPECT_EQ(quantile(values, 0.995), 995.0);
  EXPECT_EQ(quantile(values, 0.99), 990.0);
  EXPECT_EQ(quantile(values, 1.0), 1000.0);
}

TEST(RecordEvaluation, OfTheOwnSolverOnItsOwnModelFindsNothingToBlame) {
  const RecordSummary summary = summarise(samples_of(models_of(), closing(), {}, true));
  EXPECT_EQ(summary.frames, 300U);
  EXPECT_EQ(summary.frames_without_hand, 0U);
  EXPECT_GT(summary.moved, 50U);
  EXPECT_EQ(summary.frozen, 0U);
  EXPECT_EQ(summary.frozen_fraction, 0.0);
  EXPECT_LT(*summary.cost_p995, 1.01);
  EXPECT_TRUE(summary.costly.empty());
  for (std::size_t f = 0; f < kFingers; ++f) {
    ASSERT_TRUE(summary.residual_mm[f].has_value());
    EXPECT_LT(*summary.residual_mm[f], 2.0) << kFingerNames[f];
    EXPECT_FALSE(summary.unseen_mm[f].has_value());
  }
}

TEST(RecordEvaluation, CallsASolverThatDoesNothingFrozenAndCostly) {
  config::EmbodyConfig config;
  OperatorModels models = models_of(config);
  models.fingers.max_iterations = 0;
  const RecordSummary summary = summarise(samples_of(models, closing(), {}, true));
  EXPECT_GT(summary.moved, 50U);
  EXPECT_EQ(summary.frozen + summary.still_at_bound, summary.moved);
  EXPECT_GT(*summary.frozen_fraction, 0.9);
  EXPECT_GT(*summary.cost_max, 2.0);
  EXPECT_EQ(summary.costly_frames, summary.costly.size());
  EXPECT_GT(summary.costly_frames, 200U);
  EXPECT_EQ(*summary.joint_step_deg.max, 0.0);
}

TEST(RecordEvaluation, DoesNotLetTheFitSeeMarkersThatItOnlyJudges) {
  const std::vector<std::string> fit{"thumb_tip",  "thumb_middle", "index_tip", "index_middle",
                                     "middle_tip", "ring_tip",     "little_tip"};
  std::vector<MarkerFrame> moved = closing();
  constexpr std::size_t kRingMiddle = 10;
  for (MarkerFrame& frame : moved) frame.markers[kRingMiddle].p_W.z() += 0.1;
  const RecordSummary honest = summarise(samples_of(models_of(), closing(), fit));
  const RecordSummary shifted = summarise(samples_of(models_of(), moved, fit));
  const auto ring = static_cast<std::size_t>(Finger::kRing);
  for (std::size_t f = 0; f < kFingers; ++f) EXPECT_EQ(honest.residual_mm[f], shifted.residual_mm[f]);
  ASSERT_TRUE(honest.unseen_mm[ring].has_value());
  EXPECT_NEAR(*shifted.unseen_mm[ring], 100.0, *honest.unseen_mm[ring] + 1.0);
  EXPECT_FALSE(honest.unseen_mm[0].has_value());
}

TEST(RecordEvaluation, RefusesToFitAMarkerThatTheGloveHasNot) {
  EvaluationOptions options;
  options.fit = {"index_tip", "hand_top"};
  const auto samples = evaluate_record(models_of(), closing(), options);
  ASSERT_FALSE(samples.ok());
  EXPECT_NE(samples.error().detail.view().find("'hand_top' is no finger marker"), std::string_view::npos);
}

TEST(RecordEvaluation, NotesEachTimeThatAMarkerComesOrGoes) {
  std::vector<MarkerFrame> frames = synthetic_frames(0, 60);  // nothing is missing in the first second
  const std::size_t before = samples_of(models_of(), frames).transition_step_rad.size();
  constexpr std::size_t kIndexTip = 5;
  for (std::size_t k = 20; k < 30; ++k) frames[k].markers[kIndexTip].visible = false;
  const RecordSamples gap = samples_of(models_of(), frames);
  EXPECT_EQ(gap.transition_step_rad.size(), before + 2);
  EXPECT_EQ(gap.markers[2].name, "index_tip");
  EXPECT_EQ(gap.markers[2].missing, 10U);
  EXPECT_EQ(gap.markers[2].distance_m.size(), 50U);
}

TEST(RecordEvaluation, LeavesOutFramesWithoutAHand) {
  std::vector<MarkerFrame> frames = closing();
  for (std::size_t k = 100; k < 110; ++k) frames[k].markers[0].visible = false;
  const RecordSamples samples = samples_of(models_of(), frames);
  EXPECT_EQ(samples.frames_without_hand, 10U);
  EXPECT_EQ(samples.joint_step_rad.size(), 15U * (300 - 1 - 11));
}

TEST(RecordEvaluation, PoolsRecordingsAsIfTheyWereOne) {
  const RecordSamples one = samples_of(models_of(), synthetic_frames(0, 100));
  const RecordSamples two = samples_of(models_of(), synthetic_frames(300, 50));
  RecordSamples both;
  both.add(one);
  both.add(two);
  EXPECT_EQ(both.frames, 150U);
  EXPECT_EQ(both.moved, one.moved + two.moved);
  EXPECT_EQ(both.joint_step_rad.size(), one.joint_step_rad.size() + two.joint_step_rad.size());
  ASSERT_EQ(both.markers.size(), 10U);
  EXPECT_EQ(both.markers[9].distance_m.size(), one.markers[9].distance_m.size() + two.markers[9].distance_m.size());
}

TEST(RecordEvaluation, TimesEveryFrameInEveryRun) {
  EvaluationOptions options;
  options.reference = false;
  const auto samples = evaluate_record(models_of(), synthetic_frames(0, 30), options);
  ASSERT_TRUE(samples.ok());
  for (const auto& run : samples->solve_us) {
    ASSERT_EQ(run.size(), 30U);
    for (const double us : run) EXPECT_GE(us, 0.0);
  }
}

TEST(RecordSummary, HasTheDocumentedJsonKeys) {
  const RecordSummary summary =
      summarise(samples_of(models_of(), closing(), {"thumb_tip", "index_tip", "middle_tip", "ring_tip"}, true));
  const json object = json::parse(summary_json(summary));
  for (const char* key : {"residual_mm", "unseen_mm"}) {
    for (const char* finger : kFingerNames) EXPECT_TRUE(object.at(key).contains(finger)) << key << " " << finger;
  }
  EXPECT_TRUE(object["residual_mm"]["little"].is_null());
  EXPECT_TRUE(object["unseen_mm"]["little"].is_number());
  EXPECT_EQ(object["markers_mm"].size(), 10U);
  EXPECT_TRUE(object["frozen_fraction"].is_number());
  for (const char* key : {"p50", "p99", "max"}) {
    EXPECT_TRUE(object["joint_step_deg"][key].is_number()) << key;
    EXPECT_TRUE(object["solve_us"].contains(key)) << key;
  }
  EXPECT_TRUE(object["cost_ratio"]["p995"].is_number());
  EXPECT_TRUE(object["cost_ratio"]["max"].is_number());
  EXPECT_TRUE(object.contains("transition_step_deg"));
}

}  // namespace
}  // namespace embody::evaluate
