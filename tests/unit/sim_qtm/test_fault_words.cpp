#include "drivers/sim/qtm/fault_words.hpp"

#include <gtest/gtest.h>

#include <sstream>

namespace embody::sim {
namespace {

TEST(FaultWords, EveryFaultOfTheHelpParsesWithItsArgumentsAndNotWithOneMore) {
  std::istringstream lines(fault_help());
  std::string line;
  int faults = 0;
  while (std::getline(lines, line)) {
    ++faults;
    std::istringstream words(line.substr(0, line.find("  ")));
    std::string text;
    std::string word;
    for (words >> text; words >> word;) {
      if (word == "[on|off]") word = "off";
      if (word == "+X..-Z") word = "-Y";
      if (text == "event" || text.starts_with("camera_link")) word = "5";
      if (word == "N" || word == "MS" || word == "MM" || word == "HZ" || word == "F") word = "7";
      text += " " + word;
    }
    EXPECT_TRUE(parse_qtm_fault(text).ok()) << text;
    EXPECT_FALSE(parse_qtm_fault(text + " surplus").ok()) << text;
  }
  EXPECT_EQ(faults, 34);
}

TEST(FaultWords, ReadsNamesNumbersAndSwitches) {
  const auto gap = parse_qtm_fault("  gap\tthumb_tip  30 ");
  ASSERT_TRUE(gap.ok());
  EXPECT_EQ(gap->kind, FaultKind::kGap);
  EXPECT_EQ(gap->a, "thumb_tip");
  EXPECT_EQ(gap->value, 30.0);
  const auto swap = parse_qtm_fault("swap \"Table - 1\" b");
  ASSERT_TRUE(swap.ok());
  EXPECT_EQ(swap->a, "Table - 1");
  EXPECT_EQ(swap->b, "b");
  EXPECT_TRUE(parse_qtm_fault("ghost m")->on);
  EXPECT_FALSE(parse_qtm_fault("ghost m off")->on);
  EXPECT_EQ(parse_qtm_fault("step m -9.5")->value, -9.5);
  EXPECT_EQ(parse_qtm_fault("camera_link 20 30")->second_value, 30.0);
}

TEST(FaultWords, RefusesEverythingElseWithASentence) {
  for (const char* wrong :
       {"",           "   ",       "explode",     "Drop a 5",      "drop",          "drop a",
        "drop a 0",   "drop a -1", "drop a 1.5",  "drop a x",      "drop a 1e9",    "drop a nan",
        "drop a inf", "drop a 5x", "axis Z",      "axis +W",       "axis",          "stall 0",
        "stall 1e9",  "event 0",   "event 17",    "ghost m maybe", "swap a",        "scale 0",
        "hide \"a",   "hide a\"b", "hide \"a\"b", "hide \"\"",     "camera_link 1", "camera_link 1001 0",
        "reorder now"}) {
    const auto fault = parse_qtm_fault(wrong);
    ASSERT_FALSE(fault.ok()) << wrong;
    EXPECT_EQ(fault.error().code, Errc::kInvalidArgument);
    EXPECT_FALSE(fault.error().detail.empty());
  }
  EXPECT_FALSE(parse_qtm_fault("hide " + std::string(200, 'x')).ok());
  EXPECT_EQ(parse_qtm_fault("drop a 0").error().detail.view(), "usage: drop M N (from 1 to 1e+06, whole)");
}

TEST(FaultScript, SortsByTimeAndKeepsTheOrderOfTheLines) {
  const auto script = parse_fault_script(
      "# warm-up\n\n2s hide a\r\n100 drop b 5\n  1.005s stall 200\n200 show a\n0 reorder\n", /*rate_hz=*/100.0);
  ASSERT_TRUE(script.ok()) << script.error().detail.c_str();
  std::vector<std::pair<std::size_t, std::size_t>> order;
  for (const auto& entry : *script) order.emplace_back(entry.frame, entry.line);
  EXPECT_EQ(order, (std::vector<std::pair<std::size_t, std::size_t>>{{0, 7}, {100, 4}, {101, 5}, {200, 3}, {200, 6}}));
}

TEST(FaultScript, NamesTheLineOfAMistake) {
  for (const char* wrong : {"5 hide a\n-1 hide a", "\n1.5 hide a", "# x\nsoon hide a", "1 hide a\n2", "1 hide a\n2 fly",
                            "1 hide a\n1e30s hide a", "1 hide a\nnans hide a", "1 hide a\ns hide a"}) {
    const auto script = parse_fault_script(wrong, 100.0);
    ASSERT_FALSE(script.ok()) << wrong;
    EXPECT_NE(script.error().detail.view().find("line 2: "), std::string_view::npos) << script.error().detail.c_str();
  }
  std::string endless;
  for (int i = 0; i < 10'001; ++i) endless += "1 reorder\n";
  EXPECT_FALSE(parse_fault_script(endless, 100.0).ok());
  EXPECT_FALSE(parse_fault_script(std::string((1 << 20) + 1, '\n'), 100.0).ok());
  EXPECT_TRUE(parse_fault_script("", 100.0)->empty());
}

}  // namespace
}  // namespace embody::sim
