// `embodyctl evaluate embodiment`, `evaluate similarity` and `convert` as people and programs call them.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "daemon/control/exit_code.hpp"
#include "tests/integration/system/rig.hpp"

namespace embody::test {
namespace {

const std::string kShipped = EMBODY_SOURCE_DIR "/config/recordings/demo.tsv";
const std::string kConfig = EMBODY_SOURCE_DIR "/config/embody.toml";
const std::vector<std::string> kFingerNames{"thumb", "index", "middle", "ring", "little"};
const std::vector<std::string> kMiaColumns{"time_s",
                                           "x_m",
                                           "y_m",
                                           "z_m",
                                           "qw",
                                           "qx",
                                           "qy",
                                           "qz",
                                           "j_index_fle_rad",
                                           "j_little_fle_rad",
                                           "j_mrl_fle_rad",
                                           "j_ring_fle_rad",
                                           "j_thumb_opp_rad",
                                           "j_thumb_fle_rad",
                                           "valid"};

Finished run(std::vector<std::string> command, const std::vector<std::string>& arguments) {
  command.insert(command.end(), {"--config", kConfig});
  command.insert(command.end(), arguments.begin(), arguments.end());
  return run_program("embodyctl", command, 120);
}
Finished embodiment(const std::vector<std::string>& arguments) {
  return run({"evaluate", "embodiment"}, arguments);
}
Finished similarity(const std::vector<std::string>& arguments) {
  return run({"evaluate", "similarity"}, arguments);
}
Finished convert(const std::vector<std::string>& arguments) {
  return run({"convert"}, arguments);
}

json read_json(const TemporaryFolder& folder, const std::string& name) {
  return json::parse(folder.read(name), nullptr, false);
}

void expect_one_sentence(const Finished& result, int exit_code, const std::string& what) {
  EXPECT_EQ(result.exit_code, exit_code) << what << ": " << result.errors;
  EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << what << ": " << result.errors;
  EXPECT_EQ(result.output, "") << what;
}

/// A text trajectory: comments, names, numbers.
struct Table {
  std::vector<std::string> comments, columns;
  std::vector<std::vector<double>> rows;
};

std::vector<std::string> split(const std::string& line, char separator) {
  std::vector<std::string> fields;
  std::istringstream in(line);
  for (std::string field; std::getline(in, field, separator);) fields.push_back(field);
  return fields;
}

Table read_table(const TemporaryFolder& folder, const std::string& name, char separator) {
  Table table;
  std::istringstream in(folder.read(name));
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("# ")) {
      table.comments.push_back(line);
    } else if (table.columns.empty()) {
      table.columns = split(line, separator);
    } else {
      std::vector<double> row;
      for (const std::string& field : split(line, separator)) row.push_back(std::stod(field));
      table.rows.push_back(row);
    }
  }
  return table;
}

TEST(EvaluateEmbodiment, JudgesEveryShippedHand) {
  const TemporaryFolder folder;
  const Finished result = embodiment({kShipped, "--frames", "1-200", "--json", folder.file("figures.json")});
  ASSERT_EQ(result.exit_code, kExitOk) << result.errors;
  EXPECT_EQ(result.errors, "") << "no progress unless standard error is a terminal";
  const json hands = read_json(folder, "figures.json");
  ASSERT_TRUE(hands.is_object());
  ASSERT_EQ(hands.size(), 4U);
  for (const char* name : {"mia", "shadow", "robotiq_2f140", "barrett"}) {
    EXPECT_NE(result.output.find(name), std::string::npos) << result.output;
    ASSERT_TRUE(hands.contains(name));
    const json& hand = hands[name];
    ASSERT_EQ(hand.size(), 7U) << name;
    EXPECT_EQ(hand["frames"], 200) << name;
    ASSERT_EQ(hand["residual_mm"].size(), 5U) << name;
    ASSERT_EQ(hand["joint_step_deg"].size(), 3U) << name;
    EXPECT_LT(hand["joint_step_deg"]["max"].get<double>(), 30.0) << name;
    ASSERT_EQ(hand["cost_ratio"].size(), 2U) << name;
    EXPECT_LT(hand["cost_ratio"]["p995"].get<double>(), 1.01) << name;
    EXPECT_EQ(hand["capped_frames"], 0) << name;
    ASSERT_EQ(hand["solve_us"].size(), 3U) << name;
    EXPECT_GT(hand["solve_us"]["p50"].get<double>(), 0.0) << name;
  }
  EXPECT_TRUE(hands["robotiq_2f140"]["residual_mm"]["little"].is_null()) << "the gripper has no little finger";
  for (const std::string& finger : kFingerNames) EXPECT_TRUE(hands["mia"]["residual_mm"][finger].is_number()) << finger;
}

TEST(EvaluateEmbodiment, TakesHandFilesAndPoolsRecordings) {
  const TemporaryFolder folder;
  const Finished result = embodiment({kShipped, kShipped, "--hand", EMBODY_SOURCE_DIR "/config/hands/mia.toml,barrett",
                                      "--frames", "1-60", "--no-reference", "--json", folder.file("figures.json")});
  ASSERT_EQ(result.exit_code, kExitOk) << result.errors;
  const json hands = read_json(folder, "figures.json");
  ASSERT_EQ(hands.size(), 2U);
  EXPECT_EQ(hands["mia"]["frames"], 120);
  EXPECT_TRUE(hands["mia"]["cost_ratio"]["p995"].is_null()) << "not compared with SLSQP";
  EXPECT_TRUE(hands["barrett"]["residual_mm"]["thumb"].is_number());
}

TEST(EvaluateSimilarity, ComparesContactSurfacesWithThePaper) {
  const TemporaryFolder folder;
  const Finished result =
      similarity({kShipped, "--frames", "1-200", "--every", "20", "--json", folder.file("figures.json")});
  ASSERT_EQ(result.exit_code, kExitOk) << result.errors;
  EXPECT_EQ(result.errors, "");
  const json object = read_json(folder, "figures.json");
  ASSERT_TRUE(object.is_object());
  ASSERT_EQ(object["hands"].size(), 4U);
  for (const json& hand : object["hands"]) {
    EXPECT_EQ(hand["frames"], 10);
    ASSERT_EQ(hand["mean_mm"].size(), 5U);
    for (const auto& [finger, value] : hand["mean_mm"].items()) {
      if (value.is_null()) continue;
      EXPECT_GT(value.get<double>(), 0.0) << finger;
      EXPECT_LT(value.get<double>(), 60.0) << finger;
    }
  }
  EXPECT_EQ(object["hands"][0]["hand"], "mia");
  EXPECT_EQ(object["hands"][0]["paper_mm"]["thumb"], 12.2);
  EXPECT_TRUE(object["hands"][2]["mean_mm"]["ring"].is_null()) << "Robotiq has two fingers";
  EXPECT_TRUE(object["hands"][3]["paper_mm"].is_null()) << "Barrett is not in the paper";
}

TEST(EvaluateHands, RefuseWrongUseWithOneSentence) {
  const std::vector<std::pair<std::vector<std::string>, int>> cases{
      {{kShipped, "--frames", "5-4"}, kExitUsage},
      {{kShipped, "--frames", "1-999999"}, kExitUsage},
      {{"/nowhere/none.tsv"}, kExitFailed},
      {{kConfig}, kExitFailed},
      {{kShipped, "--json", "nodir/x"}, kExitFailed},
      {{kShipped, "--hand", "glove"}, kExitConfiguration},
      {{kShipped, "--hand", kShipped}, kExitConfiguration},
      {{kShipped, "--subject", "/none"}, kExitConfiguration}};
  for (const auto& [arguments, exit_code] : cases) {
    expect_one_sentence(embodiment(arguments), exit_code, "embodiment " + arguments.back());
    expect_one_sentence(similarity(arguments), exit_code, "similarity " + arguments.back());
  }
  EXPECT_EQ(embodiment({}).exit_code, kExitUsage);
  EXPECT_EQ(similarity({kShipped, "--every", "0"}).exit_code, kExitUsage);
}

TEST(Convert, WritesTheSameNumbersInEveryFormat) {
  const TemporaryFolder folder;
  for (const std::string format : {"csv", "tsv", "json"}) {
    const Finished result = convert({kShipped, "-o", folder.file("a." + format), "--frames", "11-60"});
    ASSERT_EQ(result.exit_code, kExitOk) << format << ": " << result.errors;
    EXPECT_EQ(result.errors, "") << format;
    EXPECT_NE(result.output.find("50 frames, 50 rows in"), std::string::npos) << result.output;
    EXPECT_NE(result.output.find("CPU us per frame"), std::string::npos) << result.output;
  }
  const Table csv = read_table(folder, "a.csv", ','), tsv = read_table(folder, "a.tsv", '\t');
  EXPECT_EQ(csv.columns, kMiaColumns);
  EXPECT_EQ(tsv.columns, kMiaColumns);
  ASSERT_FALSE(csv.comments.empty());
  EXPECT_EQ(csv.comments[0], "# format: embody trajectory 1");
  ASSERT_EQ(csv.rows.size(), 50U);
  EXPECT_EQ(csv.rows, tsv.rows);

  const json object = read_json(folder, "a.json");
  ASSERT_TRUE(object.is_object());
  ASSERT_EQ(object.size(), 3U);
  EXPECT_EQ(object["about"]["hand"], "mia");
  EXPECT_EQ(object["about"]["first_frame"], "11");
  EXPECT_EQ(object["columns"].get<std::vector<std::string>>(), kMiaColumns);
  ASSERT_EQ(object["rows"].size(), 50U);
  for (std::size_t i = 0; i < csv.rows.size(); ++i) {
    EXPECT_EQ(object["rows"][i].get<std::vector<double>>(), csv.rows[i]) << "row " << i;
  }
}

TEST(Convert, GivesUnitQuaternionsAndCoupledJointsInEveryRow) {
  const TemporaryFolder folder;
  ASSERT_EQ(convert({kShipped, "-o", folder.file("all.csv")}).exit_code, kExitOk);
  const Table table = read_table(folder, "all.csv", ',');
  ASSERT_EQ(table.columns, kMiaColumns);
  ASSERT_EQ(table.rows.size(), 1500U);
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const std::vector<double>& row = table.rows[i];
    ASSERT_EQ(row.size(), kMiaColumns.size()) << i;
    ASSERT_NEAR(row[0], 0.01 * static_cast<double>(i), 1e-9);
    ASSERT_NEAR(std::hypot(std::hypot(row[4], row[5]), std::hypot(row[6], row[7])), 1.0, 1e-8) << i;
    ASSERT_EQ(row[9], row[10]) << "the little finger mimics the middle finger, row " << i;
    ASSERT_EQ(row[11], row[10]) << "so does the ring finger, row " << i;
    ASSERT_TRUE(row[14] == 0.0 || row[14] == 1.0) << i;
  }
}

TEST(Convert, ResamplesBetweenTheSameEnds) {
  const TemporaryFolder folder;
  for (const auto& [rate, rows] : {std::pair<std::string, std::size_t>{"50", 26}, {"100", 51}, {"1000", 501}}) {
    const Finished result =
        convert({kShipped, "-o", folder.file("r.csv"), "--frames", "1-51", "--rate", rate, "--force"});
    ASSERT_EQ(result.exit_code, kExitOk) << result.errors;
    const Table table = read_table(folder, "r.csv", ',');
    ASSERT_EQ(table.rows.size(), rows) << rate << " Hz";
    EXPECT_EQ(table.rows.front()[0], 0.0);
    EXPECT_NEAR(table.rows.back()[0], 0.5, 1e-9) << rate << " Hz";
  }
}

TEST(Convert, WritesAnyShippedHandAndFixedJoints) {
  const TemporaryFolder folder;
  const std::vector<std::pair<std::string, std::size_t>> joints{
      {"mia", 6}, {"shadow", 24}, {"robotiq_2f140", 6}, {"barrett", 8}};
  for (const auto& [hand, count] : joints) {
    const std::string name = hand + ".csv";
    const Finished result = convert({kShipped, "-o", folder.file(name), "--hand", hand, "--frames", "1-20"});
    ASSERT_EQ(result.exit_code, kExitOk) << hand << ": " << result.errors;
    const Table table = read_table(folder, name, ',');
    EXPECT_EQ(table.columns.size(), 8 + count + 1) << hand;
    EXPECT_EQ(table.rows.size(), 20U) << hand;
  }
  const Finished fixed =
      convert({kShipped, "-o", folder.file("fixed.csv"), "--frames", "1-20", "--fix", "j_thumb_opp=-0.2"});
  ASSERT_EQ(fixed.exit_code, kExitOk) << fixed.errors;
  const Table table = read_table(folder, "fixed.csv", ',');
  ASSERT_EQ(table.rows.size(), 20U);
  for (const auto& row : table.rows) EXPECT_EQ(row.at(12), -0.2);
}

TEST(Convert, PutsSeveralRecordingsIntoAFolder) {
  const TemporaryFolder folder;
  std::filesystem::copy_file(kShipped, folder.file("one.tsv"));
  std::filesystem::copy_file(kShipped, folder.file("two.tsv"));
  const std::vector<std::string> inputs{folder.file("one.tsv"), folder.file("two.tsv")};
  std::vector<std::string> arguments{inputs[0], inputs[1], "-o", folder.file("out"), "--frames", "1-30"};
  const Finished result = convert(arguments);
  ASSERT_EQ(result.exit_code, kExitOk) << result.errors;
  EXPECT_EQ(read_table(folder, "out/one.csv", ',').rows.size(), 30U);
  EXPECT_EQ(read_table(folder, "out/two.csv", ',').rows.size(), 30U);

  arguments = {inputs[0], folder.file("none.tsv"), "-o", folder.file("other/"), "--frames", "1-30", "--format", "json"};
  const Finished half = convert(arguments);
  EXPECT_EQ(half.exit_code, kExitFailed) << "one of two";
  EXPECT_EQ(std::count(half.errors.begin(), half.errors.end(), '\n'), 1) << half.errors;
  EXPECT_EQ(read_json(folder, "other/one.json")["rows"].size(), 30U) << "the good one is there";
  expect_one_sentence(convert({inputs[0], inputs[1], "-o", folder.file("one.csv")}), kExitUsage, "one file for two");
}

TEST(Convert, CutsSegmentsOutOfOneSettledPass) {
  const TemporaryFolder folder;
  folder.write("segments.json", R"({"segments": [{"l1": "reach", "start_frame": 0, "end_frame": 100},
    {"l1": "grasp it", "start_frame": 100, "end_frame": 250}, {"l1": "reach", "start_frame": 400, "end_frame": 410}]})");
  const Finished result = convert({kShipped, "-o", folder.file("s.csv"), "--segments", folder.file("segments.json")});
  ASSERT_EQ(result.exit_code, kExitOk) << result.errors;
  EXPECT_EQ(read_table(folder, "s_1_reach.csv", ',').rows.size(), 100U);
  const Table grasp = read_table(folder, "s_2_grasp_it.csv", ',');
  EXPECT_EQ(read_table(folder, "s_3_reach.csv", ',').rows.size(), 10U);

  ASSERT_EQ(convert({kShipped, "-o", folder.file("whole.csv")}).exit_code, kExitOk);
  const Table whole = read_table(folder, "whole.csv", ',');
  ASSERT_EQ(grasp.rows.size(), 150U);
  ASSERT_EQ(whole.rows.size(), 1500U);
  for (std::size_t i = 0; i < grasp.rows.size(); ++i) {
    EXPECT_EQ(grasp.rows[i][0], whole.rows[100 + i][0]);
    EXPECT_EQ(grasp.rows[i][13], whole.rows[100 + i][13]) << "estimators run from the recording's start, row " << i;
  }
}

TEST(Convert, ReplacesFilesOnlyWhenTold) {
  const TemporaryFolder folder;
  folder.write("a.csv", "precious\n");
  expect_one_sentence(convert({kShipped, "-o", folder.file("a.csv"), "--frames", "1-5"}), kExitFailed, "existing file");
  EXPECT_EQ(folder.read("a.csv"), "precious\n");
  ASSERT_EQ(convert({kShipped, "-o", folder.file("a.csv"), "--frames", "1-5", "--force"}).exit_code, kExitOk);
  EXPECT_EQ(read_table(folder, "a.csv", ',').rows.size(), 5U);
}

TEST(Convert, RefusesWrongUseWithOneSentenceAndWritesNothing) {
  const TemporaryFolder folder;
  const std::string out = folder.file("x.csv"), copy = folder.file("copy.tsv");
  std::filesystem::copy_file(kShipped, copy);
  const std::vector<std::pair<std::vector<std::string>, int>> cases{
      {{kShipped, "-o", out, "--hand", "glove"}, kExitConfiguration},
      {{kShipped, "-o", out, "--subject", "/none"}, kExitConfiguration},
      {{kShipped, "-o", folder.file("x.txt")}, kExitUsage},
      {{kShipped, "-o", folder.file("nodir/x.csv")}, kExitFailed},
      {{copy, "-o", copy, "--force"}, kExitUsage},
      {{"/nowhere/none.tsv", "-o", out}, kExitFailed},
      {{kConfig, "-o", out}, kExitFailed},
      {{kShipped, "-o", out, "--frames", "5-4"}, kExitUsage},
      {{kShipped, "-o", out, "--frames", "1-999999"}, kExitUsage},
      {{kShipped, "-o", out, "--object", "a,b,c"}, kExitFailed},
      {{kShipped, "-o", out, "--fix", "j_thumb_opp"}, kExitUsage},
      {{kShipped, "-o", out, "--fix", "j_none=0"}, kExitUsage},
      {{kShipped, "-o", out, "--fix", "j_thumb_opp=5"}, kExitUsage},
      {{kShipped, "-o", out, "--events"}, kExitFailed},
      {{kShipped, "-o", out, "--segments", "/none.json"}, kExitFailed}};
  for (const auto& [arguments, exit_code] : cases) {
    expect_one_sentence(convert(arguments), exit_code, arguments.back());
    EXPECT_FALSE(std::filesystem::exists(out)) << arguments.back();
  }
  EXPECT_EQ(std::filesystem::file_size(copy), std::filesystem::file_size(kShipped));
  EXPECT_EQ(convert({kShipped}).exit_code, kExitUsage);
  EXPECT_EQ(convert({kShipped, "-o", out, "--rate", "0"}).exit_code, kExitUsage);
}

}  // namespace
}  // namespace embody::test
