#include "daemon/evaluate/similarity_report.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace embody::evaluate {
namespace {

SimilarityRow two_fingers() {
  SimilarityMean mean;
  mean.add({0.010, 0.020, {}, {}, {}});
  mean.add({0.020, 0.0205, {}, {}, {}});
  return mean.row("Robotiq 2F-140");
}

TEST(SimilarityMean, IsTheMeanInMillimetresOfEachFingerThatTheHandHas) {
  const SimilarityRow row = two_fingers();
  EXPECT_EQ(row.frames, 2U);
  EXPECT_NEAR(row.mean_mm[0].value(), 15.0, 1e-12);
  EXPECT_NEAR(row.mean_mm[1].value(), 20.25, 1e-12);
  for (const std::size_t f : {2U, 3U, 4U}) EXPECT_FALSE(row.mean_mm[f].has_value());
  EXPECT_FALSE(SimilarityMean().row("none").mean_mm[0].has_value());
}

TEST(PaperSimilarity, KnowsTheHandsOfThePaperByTheStartOfTheirName) {
  EXPECT_EQ(paper_similarity("mia")->mean_mm[4], 30.2);
  EXPECT_EQ(paper_similarity("Shadow Dexterous Hand")->mean_mm[0], 5.2);
  EXPECT_EQ(paper_similarity("robotiq_2f140")->mean_mm[1], 13.4);
  EXPECT_FALSE(paper_similarity("robotiq_2f140")->mean_mm[2].has_value());
  for (const char* other : {"barrett", "", "my", "ourmia"}) EXPECT_FALSE(paper_similarity(other).has_value()) << other;
}

TEST(SimilarityText, ShowsEachHandAboveThePapersFigures) {
  SimilarityRow unknown = two_fingers();
  unknown.hand = "barrett";
  const std::string text = similarity_text({two_fingers(), unknown});
  for (const char* part : {"15.0", "20.2", "28.6", "13.4", "763", "barrett", "not in the paper", "little"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
  }
}

TEST(SimilarityJson, HasNullWhereThereIsNoFigure) {
  SimilarityRow unknown = two_fingers();
  unknown.hand = "\xff";  // not UTF-8
  const auto json = nlohmann::json::parse(similarity_json({two_fingers(), unknown}));
  EXPECT_DOUBLE_EQ(json["hands"][0]["mean_mm"]["index"].get<double>(), 20.25);
  EXPECT_TRUE(json["hands"][0]["mean_mm"]["ring"].is_null());
  EXPECT_EQ(json["hands"][0]["paper_mm"]["thumb"], 28.6);
  EXPECT_EQ(json["hands"][0]["frames"], 2);
  EXPECT_TRUE(json["hands"][1]["paper_mm"].is_null());
}

}  // namespace
}  // namespace embody::evaluate
