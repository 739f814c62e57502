// Names of outputs, whole files, and many at once.
#include "daemon/convert/convert_job.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <thread>

#include "daemon/convert/batch.hpp"
#include "daemon/convert/trajectory_csv.hpp"
#include "daemon/convert/trajectory_json.hpp"
#include "drivers/recording/tsv_recording.hpp"
#include "drivers/transport/file.hpp"
#include "tests/unit/convert/synthetic_recording.hpp"

namespace embody::convert {
namespace {

namespace fs = std::filesystem;
using test::shipped_models;
using test::synthetic_recording;

class ConvertJobTest : public ::testing::Test {
 protected:
  ConvertJobTest() {
    char name[] = "/tmp/embody-convert-XXXXXX";
    folder_ = ::mkdtemp(name);
  }
  ~ConvertJobTest() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string file(const std::string& name) const { return folder_ + "/" + name; }
  [[nodiscard]] std::string read(const std::string& name) const {
    const auto text = transport::load_text(file(name), 1U << 24U, "text");
    EXPECT_TRUE(text.ok()) << name;
    return text.ok() ? *text : "";
  }
  std::string save_recording(const std::string& name, std::size_t frames, const std::string& events = "") const {
    std::string text = recording::format_tsv(synthetic_recording(frames)).value();
    text.insert(text.find("MARKER_NAMES"), events);
    EXPECT_TRUE(transport::save_text(text, file(name), true).ok());
    return file(name);
  }

  std::string folder_;
};

using Plan = ConvertJobTest;

TEST_F(Plan, TakesAFileForOneRecordingAndItsFormatFromTheName) {
  for (const auto& [name, format] :
       {std::pair{"o.csv", TextFormat::kCsv}, {"o.tsv", TextFormat::kTsv}, {"o.json", TextFormat::kJson}}) {
    const auto jobs = plan_jobs({"a.tsv"}, file(name), std::nullopt);
    ASSERT_TRUE(jobs.ok()) << jobs.error().detail.view();
    ASSERT_EQ(jobs->size(), 1U);
    EXPECT_EQ(jobs->front().output, file(name));
    EXPECT_EQ(jobs->front().format, format);
  }
  EXPECT_FALSE(plan_jobs({"a.tsv"}, file("o.txt"), std::nullopt).ok());
  EXPECT_EQ(plan_jobs({"a.tsv"}, file("o.txt"), TextFormat::kJson)->front().format, TextFormat::kJson);
}

TEST_F(Plan, TakesAFolderForManyAndNamesTheFilesAfterTheRecordings) {
  const auto jobs = plan_jobs({"x/a.tsv", "y/b.tsv"}, folder_, std::nullopt);
  ASSERT_TRUE(jobs.ok());
  ASSERT_EQ(jobs->size(), 2U);
  EXPECT_EQ((*jobs)[0].output, file("a.csv"));
  EXPECT_EQ((*jobs)[1].output, file("b.csv"));
  EXPECT_EQ(plan_jobs({"x/a.tsv"}, folder_, TextFormat::kJson)->front().output, file("a.json"));
  EXPECT_EQ(plan_jobs({"a.tsv", "b.tsv"}, "new", std::nullopt)->back().output, "new/b.csv");
}

TEST_F(Plan, RefusesWhatWouldOverwriteAnotherOutputOrARecording) {
  EXPECT_FALSE(plan_jobs({"a.tsv", "b.tsv"}, file("o.csv"), std::nullopt).ok()) << "one file for two";
  EXPECT_FALSE(plan_jobs({"x/a.tsv", "y/a.tsv"}, folder_, std::nullopt).ok()) << "the same name twice";
  const std::string recording = save_recording("a.tsv", 3);
  EXPECT_FALSE(plan_jobs({recording}, recording, std::nullopt).ok());
  EXPECT_FALSE(plan_jobs({recording}, folder_, TextFormat::kTsv).ok());
  fs::create_symlink(recording, file("link.tsv"));
  EXPECT_FALSE(plan_jobs({recording}, file("link.tsv"), std::nullopt).ok());
}

TEST(SegmentPath, HasNumberAndAHarmlessLabel) {
  EXPECT_EQ(segment_path("dir/out.csv", 3, "grasp"), "dir/out_3_grasp.csv");
  EXPECT_EQ(segment_path("out.json", 1, "../a b/\n"), "out_1_.._a_b__.json");
  EXPECT_EQ(segment_path("out.csv", 2, ""), "out_2.csv");
}

TEST_F(ConvertJobTest, WritesTheSameTrajectoryInEveryFormat) {
  const std::string recording = save_recording("a.tsv", 40);
  for (const TextFormat format : {TextFormat::kCsv, TextFormat::kTsv, TextFormat::kJson}) {
    const std::string name = std::string("o.") + kTextFormatNames[static_cast<std::size_t>(format)];
    ConversionOptions options;
    options.hand = "mia";
    const auto report = run_job(shipped_models(), {recording, file(name), format}, {}, options, false);
    ASSERT_TRUE(report.ok()) << report.error().detail.view();
    EXPECT_EQ(report->rows, 40U);
  }
  const auto csv = parse_csv(read("o.csv"), "o.csv"), tsv = parse_csv(read("o.tsv"), "o.tsv");
  const auto json = parse_json(read("o.json"), "o.json");
  ASSERT_TRUE(csv.ok() && tsv.ok() && json.ok());
  EXPECT_EQ(csv->rows.size(), 40U);
  EXPECT_EQ(csv->q, tsv->q);
  EXPECT_EQ(csv->q, json->q);
  EXPECT_EQ(csv->hand, "mia");
  EXPECT_EQ(csv->source, recording);
}

TEST_F(ConvertJobTest, WritesOneFilePerSegmentOfMetadataOrEvents) {
  const std::string recording = save_recording("a.tsv", 60, "EVENT\treach\t5\t0.04\nEVENT\tend\t20\t0.19\n");
  const std::string metadata =
      R"({"segments": [{"l1": "grasp", "start_frame": 10, "end_frame": 30}, {"l1": "lift", "start_frame": 30, "end_frame": 60}]})";
  ASSERT_TRUE(transport::save_text(metadata, file("a.json"), true).ok());
  for (const std::string& from : {file("a.json"), folder_}) {
    const auto report =
        run_job(shipped_models(), {recording, file("o.csv"), TextFormat::kCsv}, {from, false, "", 1}, {}, true);
    ASSERT_TRUE(report.ok()) << report.error().detail.view();
    EXPECT_EQ(report->outputs, (std::vector<std::string>{file("o_1_grasp.csv"), file("o_2_lift.csv")}));
    const auto grasp = parse_csv(read("o_1_grasp.csv"), "o_1_grasp.csv");
    ASSERT_TRUE(grasp.ok());
    EXPECT_EQ(grasp->rows.size(), 20U);
    EXPECT_EQ(grasp->label, "grasp");
    EXPECT_EQ(grasp->first_frame, 11U);
  }
  const auto report =
      run_job(shipped_models(), {recording, file("e.csv"), TextFormat::kCsv}, {"", true, "", 1}, {}, false);
  ASSERT_TRUE(report.ok()) << report.error().detail.view();
  EXPECT_EQ(parse_csv(read("e_1_reach.csv"), "e")->rows.size(), 16U);
  EXPECT_FALSE(fs::exists(file("o.csv")));
}

TEST_F(ConvertJobTest, ReplacesFilesOnlyWhenAllowedAndWritesNothingAfterAnError) {
  const std::string recording = save_recording("a.tsv", 10);
  const ConvertJob job{recording, file("o.csv"), TextFormat::kCsv};
  ASSERT_TRUE(run_job(shipped_models(), job, {}, {}, false).ok());
  const auto refused = run_job(shipped_models(), job, {}, {}, false);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, Errc::kRefused);
  EXPECT_TRUE(run_job(shipped_models(), job, {}, {}, true).ok());

  ConversionOptions bad;
  bad.range = {1, 11};
  EXPECT_FALSE(run_job(shipped_models(), {recording, file("n.csv"), TextFormat::kCsv}, {}, bad, false).ok());
  EXPECT_FALSE(fs::exists(file("n.csv")));
  EXPECT_EQ(run_job(shipped_models(), {file("none.tsv"), file("n.csv"), TextFormat::kCsv}, {}, {}, false).error().code,
            Errc::kNotFound);
}

TEST(Batch, DoesEveryPieceOnceOnAnyNumberOfThreads) {
  for (const std::size_t threads : {1U, 2U, 7U, 300U}) {
    std::vector<std::atomic<int>> done(50);
    run_batch(done.size(), threads,
              [&](std::size_t i, const Progress& progress) {
                progress(0.5);
                ++done[i];
              },
              {});
    for (const auto& count : done) EXPECT_EQ(count.load(), 1);
  }
  run_batch(0, 4, [](std::size_t, const Progress&) { FAIL(); }, {});
}

TEST(Batch, TellsThePartThatIsDoneOfEverything) {
  std::atomic<bool> told{false};
  double part = -1.0;
  run_batch(
      2, 1,
      [&](std::size_t i, const Progress& progress) {
        if (i == 0) return;
        progress(0.5);
        while (!told.load()) std::this_thread::yield();
      },
      [&](double now) {
        part = now;
        told = now >= 0.75;
      });
  EXPECT_EQ(part, 0.75);
}

}  // namespace
}  // namespace embody::convert
