// `embodyctl evaluate record` as people and programs call it.
#include <filesystem>

#include "daemon/control/exit_code.hpp"
#include "tests/integration/system/rig.hpp"

namespace embody::test {
namespace {

const std::string kShipped = EMBODY_SOURCE_DIR "/config/recordings/demo.tsv";
const std::string kConfig = EMBODY_SOURCE_DIR "/config/embody.toml";
const std::string kReal = EMBODY_SOURCE_DIR "/../shared/data/small_pillow.tsv";

Finished evaluate(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"evaluate", "record", "--config", kConfig});
  return run_program("embodyctl", arguments, 120);
}

json figures(const TemporaryFolder& folder) {
  return json::parse(folder.read("figures.json"), nullptr, false);
}

TEST(EvaluateCommand, JudgesTheShippedRecording) {
  const TemporaryFolder folder;
  const Finished result = evaluate({kShipped, "--frames", "1-400", "--json", folder.file("figures.json")});
  ASSERT_EQ(result.exit_code, kExitOk) << result.errors;
  EXPECT_EQ(result.errors, "") << "no progress unless standard error is a terminal";
  for (const char* words :
       {"index_tip", "residual mm", "frozen fingers", "joint step", "cost / SLSQP", "five fingers us"}) {
    EXPECT_NE(result.output.find(words), std::string::npos) << words << " not in\n" << result.output;
  }
  const json object = figures(folder);
  ASSERT_TRUE(object.is_object());
  EXPECT_EQ(object["frames"], 400);
  EXPECT_EQ(object["recordings"].size(), 1U);
  ASSERT_EQ(object["residual_mm"].size(), 5U);
  for (const auto& [finger, value] : object["residual_mm"].items()) EXPECT_LT(value.get<double>(), 2.0) << finger;
  EXPECT_EQ(object["frozen_fraction"], 0.0);
  EXPECT_LT(object["cost_ratio"]["p995"].get<double>(), 1.01);
  EXPECT_GT(object["solve_us"]["p50"].get<double>(), 0.0);
}

TEST(EvaluateCommand, PoolsSeveralRecordings) {
  const TemporaryFolder folder;
  const Finished result = evaluate({kShipped, kShipped, "--frames", "1-60", "--json", folder.file("figures.json")});
  ASSERT_EQ(result.exit_code, kExitOk) << result.errors;
  EXPECT_NE(result.output.find("all 2 recordings"), std::string::npos) << result.output;
  const json object = figures(folder);
  EXPECT_EQ(object["frames"], 120);
  ASSERT_EQ(object["recordings"].size(), 2U);
  EXPECT_EQ(object["recordings"][0]["frames"], 60);
}

TEST(EvaluateCommand, ComparesSolversObjectivesAndPriors) {
  const TemporaryFolder folder;
  for (const auto& options :
       {std::vector<std::string>{"--solver", "slsqp"}, {"--objective", "published"}, {"--no-prior"}}) {
    std::vector<std::string> arguments{kShipped, "--frames", "1-30", "--json", folder.file("figures.json")};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Finished result = evaluate(arguments);
    ASSERT_EQ(result.exit_code, kExitOk) << options[0] << ": " << result.errors;
    EXPECT_TRUE(figures(folder)["residual_mm"]["index"].is_number()) << options[0];
  }
}

TEST(EvaluateCommand, RefusesWrongUseWithOneSentence) {
  const std::vector<std::pair<std::vector<std::string>, int>> cases{
      {{kShipped, "--frames", "5-4"}, kExitUsage},
      {{kShipped, "--frames", "1-999999"}, kExitUsage},
      {{kShipped, "--fit", "elbow"}, kExitUsage},
      {{"/nowhere/none.tsv"}, kExitFailed},
      {{kConfig}, kExitFailed},
      {{kShipped, "--json", "nodir/x"}, kExitFailed},
      {{kShipped, "--json", ""}, kExitFailed},
      {{kShipped, "--json", "/tmp"}, kExitFailed},
      {{kShipped, "--subject", kShipped}, kExitConfiguration},
      {{kShipped, "--subject", "/none"}, kExitConfiguration}};
  for (const auto& [arguments, exit_code] : cases) {
    const Finished result = evaluate(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << arguments.back() << ": " << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
  }
  EXPECT_EQ(evaluate({}).exit_code, kExitUsage);
  EXPECT_EQ(evaluate({kShipped, "--solver", "magic"}).exit_code, kExitUsage);
}

TEST(EvaluateCommand, OnTheRealRecordingHasNoDeadBandAndEqualsTheReferenceSolver) {
  if (!std::filesystem::exists(kReal)) GTEST_SKIP() << "the real recording is not here: " << kReal;
  const TemporaryFolder folder;
  const Finished result = evaluate({kReal, "--frames", "1001-3000", "--fit",
                                    "thumb_tip,thumb_middle,index_tip,index_middle,middle_tip,ring_tip,little_tip",
                                    "--json", folder.file("figures.json")});
  ASSERT_EQ(result.exit_code, kExitOk) << result.errors;
  const json object = figures(folder);
  EXPECT_LT(object["frozen_fraction"].get<double>(), 0.001);
  EXPECT_LE(object["joint_step_deg"]["p99"].get<double>(), 5.0);
  EXPECT_LE(object["transition_step_deg"].get<double>(), 5.0);
  EXPECT_LE(object["cost_ratio"]["p995"].get<double>(), 1.01);
  EXPECT_TRUE(object["unseen_mm"]["ring"].is_number());
  EXPECT_TRUE(object["unseen_mm"]["thumb"].is_null());
}

}  // namespace
}  // namespace embody::test
