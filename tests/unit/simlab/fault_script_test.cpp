#include "daemon/simlab/fault_script.hpp"

#include <gtest/gtest.h>

#include <random>

namespace embody::sim {
namespace {

using std::chrono::milliseconds;

Status all_known(std::string_view) {
  return {};
}

std::string refused(std::string_view text) {
  const auto script = parse_script(text, "f.faults", all_known);
  return script ? "accepted" : std::string(script.error().detail.view());
}

TEST(FaultScript, HoldsFaultsInTheOrderOfTimeAndOfTheFileWhereTimesAreEqual) {
  const auto script = parse_script(
      "# what goes wrong\r\n"
      "2.5 qtm disconnect\r\n"
      "\n"
      "  1s\tur   freeze 0.5  \n"
      "2.5s mia unplug\n"
      "0 qtm hide \"index tip\"",
      "f.faults", all_known);
  ASSERT_TRUE(script.ok()) << script.error().detail.view();
  ASSERT_EQ(script->size(), 4U);
  EXPECT_EQ((*script)[0].command, "qtm hide \"index tip\"");
  EXPECT_EQ((*script)[0].line, 6U);
  EXPECT_EQ((*script)[1].command, "ur   freeze 0.5");
  EXPECT_EQ((*script)[1].at, milliseconds(1000));
  EXPECT_EQ((*script)[2].command, "qtm disconnect");
  EXPECT_EQ((*script)[2].at, milliseconds(2500));
  EXPECT_EQ((*script)[3].command, "mia unplug");
}

TEST(FaultScript, NamesFileLineAndReasonOfWhatItDoesNotTake) {
  for (const char* line : {"x qtm disconnect", "-1 qtm disconnect", "nan qtm disconnect", "inf qtm disconnect",
                           "1e9 qtm disconnect", "1ms qtm disconnect", "qtm disconnect"}) {
    EXPECT_EQ(refused("# first\n" + std::string(line)).find("f.faults:2: a line starts with seconds"), 0U) << line;
  }
  EXPECT_EQ(refused("1"), "f.faults:1: after the time come a device and a fault, like 'qtm disconnect'");
  EXPECT_EQ(refused("1 qtm"), "f.faults:1: after the time come a device and a fault, like 'qtm disconnect'");
  EXPECT_EQ(refused("1 qtm hide\x1b[2J"), "f.faults:1: a control character is in the line");
  EXPECT_EQ(refused(std::string("1 qtm hide\0x", 12)), "f.faults:1: a control character is in the line");
}

TEST(FaultScript, IsBounded) {
  std::string lines;
  for (std::size_t i = 0; i < kMostScriptLines; ++i) lines += "1 qtm disconnect\n";
  EXPECT_EQ(refused(lines), "accepted");
  EXPECT_EQ(refused(lines + "#\n"), "f.faults:1001: a fault script has at most 1000 lines");
  EXPECT_EQ(refused(std::string(kMostScriptBytes + 1, ' ')), "f.faults: a fault script has at most 64 KiB");
}

TEST(FaultScript, IsCheckedWholeInTheOrderInWhichItWillHappen) {
  std::vector<std::string> asked;
  const auto check = [&asked](std::string_view command) -> Status {
    asked.emplace_back(command);
    return command == "ur b" ? Status(make_error(Errc::kInvalidArgument, "no such fault")) : Status();
  };
  const auto script = parse_script("3 qtm c\n2 ur b\n1 qtm a\n", "f.faults", check);
  ASSERT_FALSE(script.ok());
  EXPECT_EQ(script.error().detail.view(), "f.faults:2: no such fault");
  EXPECT_EQ(asked, (std::vector<std::string>{"qtm a", "ur b"}));
}

TEST(FaultScript, AFileThatIsNoneIsASentence) {
  EXPECT_EQ(load_script("/nonexistent/x.faults", all_known).error().code, Errc::kNotFound);
  EXPECT_EQ(load_script("/", all_known).error().code, Errc::kInvalidArgument);
}

TEST(ScriptReader, GivesEachFaultOnceWhenItsTimeHasCome) {
  constexpr unsigned kSeed = 11;
  std::mt19937 random(kSeed);
  std::vector<ScriptedFault> faults;
  Duration at{0};
  for (std::size_t i = 0; i < 200; ++i) {
    at += milliseconds(random() % 30);
    faults.push_back({at, "qtm reorder", i + 1});
  }
  ScriptReader reader(faults);
  std::size_t given = 0;
  for (Duration now{0}; given < faults.size(); now += milliseconds(random() % 100)) {
    while (const ScriptedFault* fault = reader.take(now)) {
      ASSERT_LE(fault->at, now);
      ASSERT_EQ(fault->line, ++given) << "seed " << kSeed;
    }
    ASSERT_GT(reader.next(), now) << "nothing that is due waits";
  }
  EXPECT_EQ(reader.done(), reader.size());
  EXPECT_EQ(reader.take(Duration::max()), nullptr);
}

}  // namespace
}  // namespace embody::sim
