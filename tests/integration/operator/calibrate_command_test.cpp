// `embodyctl calibrate` from files and from a live tracker, and what becomes of its subject file.
#include <csignal>
#include <filesystem>
#include <thread>

#include "daemon/app/config_io.hpp"
#include "daemon/control/exit_code.hpp"
#include "drivers/transport/clock.hpp"
#include "tests/integration/system/rig.hpp"

namespace embody::test {
namespace {

using transport::now;

const std::string kShipped = EMBODY_SOURCE_DIR "/config/recordings/demo.tsv";
const std::string kConfig = EMBODY_SOURCE_DIR "/config/embody.toml";
const std::string kReal = EMBODY_SOURCE_DIR "/../shared/data/small_pillow.tsv";

Finished calibrate(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"calibrate", "--config", kConfig});
  return run_program("embodyctl", arguments, 120);
}

double mean_residual_mm(const std::string& recording, const std::string& frames, const std::string& subject) {
  const TemporaryFolder folder;
  std::vector<std::string> arguments{
      "evaluate", "record", recording, "--config", kConfig, "--frames", frames, "--json", folder.file("figures.json")};
  if (!subject.empty()) arguments.insert(arguments.end(), {"--subject", subject});
  const Finished result = run_program("embodyctl", arguments, 120);
  EXPECT_EQ(result.exit_code, kExitOk) << result.errors;
  const json object = json::parse(folder.read("figures.json"), nullptr, false);
  EXPECT_EQ(object["markers_mm"].size(), 10U);
  double sum = 0.0;
  for (const auto& item : object["markers_mm"].items()) sum += item.value().get<double>();
  return sum / 10.0;
}

TEST(CalibrateCommand, WritesASubjectThatDaemonAndEvaluationRead) {
  const TemporaryFolder folder;
  const std::string subject = folder.file("subject.toml");
  const Finished result =
      calibrate({kShipped, "--frames", "1-700", "--output", subject, "--json", folder.file("figures.json")});
  ASSERT_EQ(result.exit_code, kExitOk) << result.errors;
  for (const char* words : {"palm breadth", "index_tip", "before", "after", "written to"}) {
    EXPECT_NE(result.output.find(words), std::string::npos) << words << " not in\n" << result.output;
  }
  EXPECT_NE(folder.read("subject.toml").find("# from " + kShipped + ", frames 1 to 700"), std::string::npos);
  const auto loaded = config::load_subject(subject);
  ASSERT_TRUE(loaded.ok()) << loaded.error().detail.view();
  EXPECT_EQ(loaded->markers.size(), 10U);
  const json figures = json::parse(folder.read("figures.json"), nullptr, false);
  ASSERT_TRUE(figures.is_object());
  ASSERT_EQ(figures["shape"].size(), 10U);
  for (std::size_t i = 0; i < 10; ++i) EXPECT_EQ(figures["shape"][i].get<double>(), loaded->shape[i]) << i;

  folder.write("embody.toml", "schema = 1\n[subject]\nfile = \"subject.toml\"\n");
  const Finished daemon = run_program("embodyd", {"--config", folder.file("embody.toml"), "--print-config"});
  EXPECT_EQ(daemon.exit_code, kExitOk) << daemon.errors;
  EXPECT_NE(daemon.output.find("[[subject.markers]]\nmarker = \"thumb_tip\""), std::string::npos) << daemon.output;
  EXPECT_LT(mean_residual_mm(kShipped, "1-300", subject), 2.0);
}

TEST(CalibrateCommand, NeverOverwritesUnlessForced) {
  const TemporaryFolder folder;
  folder.write("subject.toml", "mine");
  const std::vector<std::string> arguments{kShipped, "--frames", "1-300", "--output", folder.file("subject.toml")};
  const Finished refused = calibrate(arguments);
  EXPECT_EQ(refused.exit_code, kExitFailed);
  EXPECT_NE(refused.errors.find("--force"), std::string::npos) << refused.errors;
  EXPECT_EQ(folder.read("subject.toml"), "mine");
  std::vector<std::string> forced = arguments;
  forced.emplace_back("--force");
  EXPECT_EQ(calibrate(forced).exit_code, kExitOk);
  EXPECT_NE(folder.read("subject.toml").find("schema = 1"), std::string::npos);
}

TEST(CalibrateCommand, RefusesWhatItCannotUseAndWritesNothing) {
  const TemporaryFolder folder;
  const std::string output = folder.file("subject.toml");
  EXPECT_EQ(calibrate({kShipped, "--frames", "x", "--output", output}).exit_code, kExitUsage);
  EXPECT_EQ(calibrate({"/nowhere/none.tsv", "--output", output}).exit_code, kExitFailed);
  EXPECT_EQ(calibrate({kShipped, "--output", folder.file("none/subject.toml")}).exit_code, kExitFailed);
  const Finished few = calibrate({kShipped, "--frames", "1-2", "--output", output});
  EXPECT_EQ(few.exit_code, kExitFailed) << few.output;
  EXPECT_EQ(calibrate({"--frames", "1-700", "--output", output}).exit_code, kExitUsage) << "there is no recording";
  EXPECT_EQ(calibrate({kShipped, "--duration", "5", "--output", output}).exit_code, kExitUsage);
  EXPECT_EQ(calibrate({kShipped, "--output", output, "--json", output}).exit_code, kExitUsage);
  EXPECT_EQ(calibrate({kShipped, "--output", output, "--json", folder.file("none/figures.json")}).exit_code,
            kExitFailed);
  EXPECT_EQ(calibrate({kShipped, "--output", output, "--json", ""}).exit_code, kExitFailed);
  folder.write("mine.json", "mine");
  EXPECT_EQ(calibrate({kShipped, "--output", output, "--json", folder.file("mine.json")}).exit_code, kExitFailed);
  EXPECT_EQ(folder.read("mine.json"), "mine");
  EXPECT_FALSE(std::filesystem::exists(output));
}

TEST(CalibrateCommand, ImprovesOnTheManualConfigurationOfTheRealRecording) {
  if (!std::filesystem::exists(kReal)) GTEST_SKIP() << "the real recording is not here: " << kReal;
  const TemporaryFolder folder;
  const std::string subject = folder.file("subject.toml");
  const Finished result = calibrate({kReal, "--frames", "1-1000", "--output", subject});
  ASSERT_EQ(result.exit_code, kExitOk) << result.errors;
  const double before_mm = mean_residual_mm(kReal, "1001-3000", "");
  const double after_mm = mean_residual_mm(kReal, "1001-3000", subject);
  std::printf("mean residual of frames 1001 to 3000: %.2f mm before, %.2f mm after\n", before_mm, after_mm);
  EXPECT_LE(after_mm, 3.0);
  EXPECT_LT(after_mm, before_mm);
}

/// A lab that plays a recording once it is told to, and embodyctl in front of it.
struct LiveBench {
  Rig rig{{.start_daemon = false}};
  std::string subject = rig.folder.file("subject.toml");

  ctl::ChildProcess start(int duration_s) {
    auto child = ctl::ChildProcess::start(std::string(EMBODY_BINARY_DIR) + "/embodyctl",
                                          {"calibrate", "--config", rig.folder.file("embody.toml"), "--duration",
                                           std::to_string(duration_s), "--output", subject},
                                          rig.folder.file("calibrate.log"));
    EXPECT_TRUE(child.ok()) << child.error().detail.view();
    return std::move(*child);
  }
  static bool says(ctl::ChildProcess& child, const std::string& words) {
    const TimePoint deadline = now() + std::chrono::seconds(20);
    while (now() < deadline) {
      for (auto line = child.next_line(); line; line = child.next_line()) {
        if (line->find(words) != std::string::npos) return true;
      }
      if (child.exit_code()) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }
};

TEST(LiveCalibration, CollectsFromTheTrackerAndWritesASubject) {
  LiveBench bench;
  ctl::ChildProcess child = bench.start(4);
  ASSERT_TRUE(LiveBench::says(child, "Connected to"));
  bench.rig.lab("play");
  ASSERT_TRUE(LiveBench::says(child, "Go:"));
  ASSERT_TRUE(LiveBench::says(child, "written to"));
  EXPECT_EQ(child.wait(now() + std::chrono::seconds(10)), kExitOk) << bench.rig.folder.read("calibrate.log");
  EXPECT_TRUE(config::load_subject(bench.subject).ok());
}

TEST(LiveCalibration, EndsWithCtrlCAndWritesNothing) {
  LiveBench bench;
  ctl::ChildProcess child = bench.start(30);
  ASSERT_TRUE(LiveBench::says(child, "Connected to"));
  bench.rig.lab("play");
  ASSERT_TRUE(LiveBench::says(child, "Go:"));
  child.signal(SIGINT);
  EXPECT_EQ(child.wait(now() + std::chrono::seconds(10)), kExitInterrupted);
  EXPECT_FALSE(std::filesystem::exists(bench.subject));
  EXPECT_NE(bench.rig.folder.read("calibrate.log").find("nothing was written"), std::string::npos);
}

TEST(LiveCalibration, SaysThatTheTrackerIsNotThere) {
  const TemporaryFolder folder;
  folder.write("embody.toml", "schema = 1\n[tracker]\nport = 1\n");
  const Finished result = run_program(
      "embodyctl", {"calibrate", "--config", folder.file("embody.toml"), "--output", folder.file("subject.toml")});
  EXPECT_EQ(result.exit_code, kExitUnavailable) << result.errors;
  EXPECT_NE(result.errors.find("127.0.0.1:1"), std::string::npos) << result.errors;
}

TEST(LiveCalibration, SaysThatTheMeasurementIsNotRunning) {
  LiveBench bench;
  ctl::ChildProcess child = bench.start(10);
  EXPECT_EQ(child.wait(now() + std::chrono::seconds(20)), kExitUnavailable);
  EXPECT_NE(bench.rig.folder.read("calibrate.log").find("start the measurement"), std::string::npos);
}

}  // namespace
}  // namespace embody::test
