// Segments from metadata and from events, and the sentences about damage.
#include "daemon/convert/segments.hpp"

#include <gtest/gtest.h>

namespace embody::convert {
namespace {

const std::string kOld = R"({"platform_type": ".tsv", "record_filename": "trial.tsv", "segments": [
  {"l1": "approach", "l2": "reach", "start_frame": 0, "end_frame": 120},
  {"l1": "grasp", "l2": "pinch", "start_frame": "120", "end_frame": "300"}]})";
const std::string kNew = R"({"segments": [
  {"label 1": "approach", "label 2": "reach", "start index": 0, "end index": 120},
  {"label 1": "grasp", "label 2": "pinch", "start index": 120, "end index": 300}]})";

TEST(Segments, AreTheSameInBothPublishedFormats) {
  for (const std::string& text : {kOld, kNew}) {
    const auto segments = parse_segments(text, "trial.json");
    ASSERT_TRUE(segments.ok()) << segments.error().detail.view();
    ASSERT_EQ(segments->size(), 2U);
    EXPECT_EQ((*segments)[0].label, "approach");
    EXPECT_EQ((*segments)[0].first, 1U) << "index 0 is frame 1";
    EXPECT_EQ((*segments)[0].last, 120U) << "the end is not part of the segment";
    EXPECT_EQ((*segments)[1].label, "grasp");
    EXPECT_EQ((*segments)[1].first, 121U);
    EXPECT_EQ((*segments)[1].last, 300U);
    EXPECT_EQ(parse_segments(text, "trial.json", 2).value()[1].label, "pinch");
  }
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

template <class T>
void expect_error(const Result<T>& result, const std::vector<std::string>& told) {
  ASSERT_FALSE(result.ok());
  for (const std::string& words : told) {
    EXPECT_NE(std::string(result.error().detail.view()).find(words), std::string::npos)
        << words << " not in: " << result.error().detail.view();
  }
}

TEST(Segments, ThatAreDamagedAreRefusedWithSegmentAndField) {
  const auto refuse = [](const std::string& text, std::vector<std::string> told) {
    told.emplace_back("trial.json");
    expect_error(parse_segments(text, "trial.json"), told);
  };
  refuse(replaced(kOld, "\"end_frame\": \"300\"", "\"end_frame\": \"3oo\""), {"segment 2", "\"end_frame\"", "number"});
  refuse(replaced(kOld, "\"start_frame\": 0", "\"start_frame\": -1"), {"segment 1", "\"start_frame\""});
  refuse(replaced(kOld, "\"start_frame\": 0", "\"start_frame\": 0.5"), {"segment 1", "\"start_frame\""});
  refuse(replaced(kOld, "\"end_frame\": 120", "\"end_frame\": 0"), {"segment 1", "greater", "\"end_frame\" 0"});
  refuse(replaced(kOld, "\"l1\": \"grasp\"", "\"l1\": 7"), {"segment 2", "\"l1\"", "text"});
  refuse(replaced(kOld, "\"l1\": \"grasp\"", "\"name\": \"grasp\""), {"segment 2", "\"l1\" is missing"});
  refuse(replaced(kNew, "\"end index\": 300", "\"end\": 300"), {"segment 2", "\"end index\" is missing"});
  refuse("{\"segments\": [3]}", {"segment 1"});
  refuse("{\"segments\": []}", {"no segment"});
  refuse("{\"segments\": {}}", {"no list \"segments\""});
  refuse("[]", {"no list \"segments\""});
  refuse("frames", {"no JSON"});
  refuse("", {"no JSON"});
}

TEST(Segments, BeyondTheRecordingAreRefused) {
  const auto segments = parse_segments(kOld, "trial.json");
  ASSERT_TRUE(segments.ok());
  EXPECT_TRUE(check_segments(*segments, 300, "trial.tsv").ok());
  const Status status = check_segments(*segments, 299, "trial.tsv");
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().detail.view().find("segment 2 'grasp'"), std::string_view::npos);
  EXPECT_NE(status.error().detail.view().find("121 to 300"), std::string_view::npos);
}

TEST(Segments, CanBeChosenByLabel) {
  const auto segments = parse_segments(kOld, "trial.json");
  ASSERT_TRUE(segments.ok());
  const auto kept = with_label(*segments, "grasp", "trial.json");
  ASSERT_TRUE(kept.ok());
  ASSERT_EQ(kept->size(), 1U);
  EXPECT_EQ((*kept)[0].first, 121U);
  expect_error(with_label(*segments, "grosp", "trial.json"), {"trial.json", "'grosp'", "'grasp'"});
}

std::string tsv(const std::string& events, const std::string& first_row = "1\t0.00000\t1.0\t2.0\t3.0") {
  return "NO_OF_FRAMES\t9\r\nFREQUENCY\t100\r\n" + events + "MARKER_NAMES\tA\r\nFrame\tTime\tA X\tA Y\tA Z\r\n" +
         first_row + "\r\n";
}

TEST(EventSegments, ArePairsOfEventsInTheOrderOfTheirFrames) {
  const auto segments = parse_event_segments(
      tsv("EVENT\tlift\t7\t0.06\r\nEVENT\tgrasp\t2\t0.01\r\nEVENT\tdone\t4\t0.03\r\nEVENT\tend\t9\t0.08\r\n"), "t.tsv");
  ASSERT_TRUE(segments.ok()) << segments.error().detail.view();
  ASSERT_EQ(segments->size(), 2U);
  EXPECT_EQ((*segments)[0].label, "grasp");
  EXPECT_EQ((*segments)[0].first, 2U);
  EXPECT_EQ((*segments)[0].last, 4U);
  EXPECT_EQ((*segments)[1].label, "lift");
  EXPECT_EQ((*segments)[1].first, 7U);
  EXPECT_EQ((*segments)[1].last, 9U);
}

TEST(EventSegments, CountInTheNumbersOfTheFrameColumn) {
  const std::string row = "501\t5.00000\t1.0\t2.0\t3.0";
  const auto segments = parse_event_segments(tsv("EVENT\tgrasp\t502\t5.01\r\nEVENT\tend\t504\t5.03\r\n", row), "t.tsv");
  ASSERT_TRUE(segments.ok());
  EXPECT_EQ((*segments)[0].first, 2U);
  EXPECT_EQ((*segments)[0].last, 4U);
  expect_error(parse_event_segments(tsv("EVENT\tgrasp\t2\t0.01\r\nEVENT\tend\t504\t5.03\r\n", row), "t.tsv"),
               {"t.tsv:3", "'grasp'", "501"});
}

TEST(EventSegments, ThatAreDamagedAreRefusedWithTheLine) {
  expect_error(parse_event_segments(tsv(""), "t.tsv"), {"t.tsv", "no EVENT"});
  expect_error(parse_event_segments(tsv("EVENT\tgrasp\t2\t0.01\r\n"), "t.tsv"), {"t.tsv:3", "'grasp'", "partner"});
  expect_error(parse_event_segments(tsv("EVENT\tgrasp\tsoon\t0.01\r\n"), "t.tsv"), {"t.tsv:3", "'grasp'", "frame"});
  expect_error(parse_event_segments(tsv("EVENT\r\n"), "t.tsv"), {"t.tsv:3", "frame number"});
  expect_error(parse_event_segments("", "t.tsv"), {"no EVENT"});
}

}  // namespace
}  // namespace embody::convert
