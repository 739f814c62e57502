#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>

#include "drivers/recording/tsv_recording.hpp"

namespace embody::recording {
namespace {

/// A small export in parts, so that each test can spoil one of them.
struct Export {
  std::string frames{"NO_OF_FRAMES\t2\n"};
  std::string count{"NO_OF_MARKERS\t2\n"};
  std::string rate{"FREQUENCY\t100\n"};
  std::string extra{"TIME_STAMP\t2021-08-26, 15:19:24.317\t1483034.68525310\n"};
  std::string names{"MARKER_NAMES\thand_top\tTable - 1\n"};
  std::string columns{"Frame\tTime\thand_top X\thand_top Y\thand_top Z\tTable - 1 X\tTable - 1 Y\tTable - 1 Z\n"};
  std::string first{"1\t0.00000\t1.000\t-2.500\t3.125\t10.000\t20.000\t30.000\n"};
  std::string second{"2\t0.01000\t1.500\t-2.000\t3.250\tnan\tnan\tnan\n"};

  std::string text() const { return frames + count + rate + extra + names + columns + first + second; }
};

Recording parse(const std::string& text) {
  auto recording = parse_tsv(text, "trial.tsv");
  EXPECT_TRUE(recording.ok()) << recording.error().detail.c_str() << "\n" << text;
  return recording.ok() ? std::move(*recording) : Recording{};
}

void expect_the_example(const Recording& recording) {
  EXPECT_EQ(recording.rate_hz, 100.0);
  EXPECT_EQ(recording.marker_names, (std::vector<std::string>{"hand_top", "Table - 1"}));
  ASSERT_EQ(recording.frames.size(), 2U);
  ASSERT_EQ(recording.frames[0].size(), 2U);
  EXPECT_TRUE(recording.frames[0][0].visible);
  EXPECT_TRUE(recording.frames[0][0].p_W.isApprox(Eigen::Vector3d(0.001, -0.0025, 0.003125), 1e-12));
  EXPECT_TRUE(recording.frames[0][1].visible);
  EXPECT_TRUE(recording.frames[1][0].p_W.isApprox(Eigen::Vector3d(0.0015, -0.002, 0.00325), 1e-12));
  EXPECT_FALSE(recording.frames[1][1].visible);
}

std::string replace_all(std::string text, const std::string& from, const std::string& to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

/// Drops the first `count` columns of a line.
std::string without_leading(const std::string& line, int count) {
  std::size_t begin = 0;
  for (int i = 0; i < count; ++i) begin = line.find('\t', begin) + 1;
  return line.substr(begin);
}

TEST(TsvRecording, ReadsTheSameRecordingFromEveryDialect) {
  const Export plain;
  expect_the_example(parse(plain.text()));
  EXPECT_EQ(parse(plain.text()).source, "trial.tsv");
  EXPECT_EQ(parse(plain.text()).time_stamp, "2021-08-26, 15:19:24.317");

  expect_the_example(parse(replace_all(plain.text(), "\n", "\r\n")));
  expect_the_example(parse(replace_all(plain.text(), "\n", "\t\r\n")));
  expect_the_example(parse("\xEF\xBB\xBF" + plain.text()));
  expect_the_example(parse(plain.text() + "\n\r\n"));
  expect_the_example(parse(plain.text().substr(0, plain.text().size() - 1)));

  Export no_columns;
  no_columns.columns.clear();
  expect_the_example(parse(no_columns.text()));
  expect_the_example(parse(replace_all(no_columns.text(), "\n", "\t\n")));

  Export bare = no_columns;
  bare.first = without_leading(bare.first, 2);
  bare.second = without_leading(bare.second, 2);
  expect_the_example(parse(bare.text()));
  expect_the_example(parse(replace_all(bare.text(), "\n", "\t\n")));

  Export no_frame;
  no_frame.columns = without_leading(no_frame.columns, 1);
  no_frame.first = without_leading(no_frame.first, 1);
  no_frame.second = without_leading(no_frame.second, 1);
  expect_the_example(parse(no_frame.text()));

  Export rich;
  rich.extra = "FILE_VERSION\t2.0.0\nEVENT\tgrasp\t1\t0.00000\nEVENT\trelease\t2\t0.01000\nDESCRIPTION\t--\n" +
               plain.extra + plain.extra + "TRAJECTORY_TYPES\tMeasured\tMixed\n";
  expect_the_example(parse(rich.text()));
}

TEST(TsvRecording, TakesAllSpellingsOfAMissingMarkerAsMissing) {
  for (const char* missing : {"nan\tnan\tnan", "NaN\tNaN\tNaN", "null\tnull\tnull", "NULL\tNULL\tNULL", "\t\t",
                              "0.000\t0.000\t0.000", "0\t-0.000\t0.0", "\t0.000\tnan"}) {
    Export file;
    file.second = std::string("2\t0.01000\t1.500\t-2.000\t3.250\t") + missing + "\n";
    expect_the_example(parse(file.text()));
    expect_the_example(parse(replace_all(file.text(), "\n", "\t\r\n")));
    file.second = std::string("2\t0.01000\t") + missing + "\t1.000\t2.000\t3.000\n";
    const auto recording = parse(file.text());
    ASSERT_EQ(recording.frames.size(), 2U) << missing;
    EXPECT_FALSE(recording.frames[1][0].visible) << missing;
    EXPECT_TRUE(recording.frames[1][1].visible) << missing;
  }
}

TEST(TsvRecording, KeepsAMarkerThatIsZeroOnOneOrTwoAxes) {
  Export file;
  file.second = "2\t0.01000\t1.500\t-2.000\t3.250\t0.000\t0.000\t5.000\n";
  EXPECT_TRUE(parse(file.text()).frames[1][1].visible);
}

TEST(TsvRecording, TakesTheRateFromTheTimeColumnWhenItIsExternal) {
  for (const char* rate : {"FREQUENCY\tEXT\n", ""}) {
    Export file;
    file.rate = rate;
    EXPECT_NEAR(parse(file.text()).rate_hz, 100.0, 1e-9) << rate;
    file.columns.clear();
    file.first = without_leading(file.first, 2);
    file.second = without_leading(file.second, 2);
    EXPECT_FALSE(parse_tsv(file.text(), "trial.tsv").ok()) << rate;
  }
}

struct Defect {
  std::string what;
  Export file;
  std::vector<std::string> told;  ///< what the sentence must contain
  Errc code{Errc::kMalformed};
};

std::vector<Defect> defects() {
  std::vector<Defect> all;
  const auto add = [&](const char* what, auto spoil, std::vector<std::string> told, Errc code = Errc::kMalformed) {
    Export file;
    spoil(file);
    all.push_back({what, file, std::move(told), code});
  };
  add("empty file", [](Export& f) { f = Export{"", "", "", "", "", "", "", ""}; }, {"MARKER_NAMES"});
  add("no MARKER_NAMES", [](Export& f) { f.names.clear(); }, {"trial.tsv", "MARKER_NAMES"});
  add("no markers", [](Export& f) { f.names = "MARKER_NAMES\n"; }, {"trial.tsv:5", "no marker"});
  add("two MARKER_NAMES", [](Export& f) { f.names += f.names; }, {":6", "twice"});
  add("duplicate name", [](Export& f) { f.names = "MARKER_NAMES\ta\ta\n"; }, {":5", "'a'"});
  add("nameless marker", [](Export& f) { f.names = "MARKER_NAMES\t\ta\n"; }, {":5", "marker 1"});
  add("wrong marker count", [](Export& f) { f.count = "NO_OF_MARKERS\t3\n"; }, {"NO_OF_MARKERS", "3", "2"});
  add("count no number", [](Export& f) { f.frames = "NO_OF_FRAMES\tmany\n"; }, {":1", "'many'"});
  add("rate no number", [](Export& f) { f.rate = "FREQUENCY\tfast\n"; }, {":3", "'fast'"});
  add("rate zero", [](Export& f) { f.rate = "FREQUENCY\t0\n"; }, {":3", "FREQUENCY"});
  add("rate nan", [](Export& f) { f.rate = "FREQUENCY\tnan\n"; }, {":3", "FREQUENCY"});
  add("times beyond any clock",
      [](Export& f) {
        f.rate = "FREQUENCY\tEXT\n";
        f.second = replace_all(f.second, "0.01000", "1e200");
      },
      {"FREQUENCY"});
  add("another kind of file", [](Export& f) { f.frames = "{\"json\": 1}\n"; }, {":1", "neither"});
  add("column missing", [](Export& f) { f.columns = replace_all(f.columns, "\thand_top Y", ""); },
      {":6", "'hand_top Y'"});
  add("last column missing", [](Export& f) { f.columns = replace_all(f.columns, "\tTable - 1 Z", ""); },
      {":6", "'Table - 1 Z'"});
  add("column too many", [](Export& f) { f.columns = replace_all(f.columns, "Z\n", "Z\tcup X\n"); }, {":6", "'cup X'"});
  add("field missing", [](Export& f) { f.first = replace_all(f.first, "\t30.000", ""); }, {":7", "'Table - 1 Z'"});
  add("field too many", [](Export& f) { f.first = replace_all(f.first, "\n", "\t1.000\n"); }, {":7", "9", "8"});
  add("not a number", [](Export& f) { f.first = replace_all(f.first, "-2.500", "-2.5oo"); },
      {":7", "'hand_top Y'", "'-2.5oo'"});
  add("decimal comma", [](Export& f) { f.first = replace_all(f.first, "20.000", "20,000"); },
      {":7", "'Table - 1 Y'", "decimal point"});
  add("infinite", [](Export& f) { f.first = replace_all(f.first, "20.000", "inf"); }, {":7", "'Table - 1 Y'"});
  add("absurdly far", [](Export& f) { f.first = replace_all(f.first, "20.000", "1e300"); }, {":7", "'Table - 1 Y'"});
  add("half a marker", [](Export& f) { f.first = replace_all(f.first, "20.000", "nan"); }, {":7", "'Table - 1 Y'"});
  add("frame no number", [](Export& f) { f.second = replace_all(f.second, "2\t0.01", "x\t0.01"); }, {":8", "Frame"});
  add("time no number", [](Export& f) { f.second = replace_all(f.second, "0.01000", "-"); }, {":8", "Time"});
  add("rows missing inside", [](Export& f) { f.second = replace_all(f.second, "2\t0.01", "5\t0.01"); },
      {":8", "frame 5 follows frame 1"});
  add(
      "fewer rows than announced", [](Export& f) { f.frames = "NO_OF_FRAMES\t3\n"; }, {"3 frames", "after 2"},
      Errc::kTruncated);
  add("more rows than announced", [](Export& f) { f.frames = "NO_OF_FRAMES\t1\n"; }, {"1 frames", "has 2"});
  add("no rows", [](Export& f) { f.frames = f.first = f.second = ""; }, {"no frames"});
  add(
      "last line cut between numbers", [](Export& f) { f.second = "2\t0.01000\t1.500\t-2.000"; },
      {":8", "cut", "'hand_top Z'"}, Errc::kTruncated);
  add(
      "last line cut in a number", [](Export& f) { f.second = "2\t0.01000\t1.500\t-2.000\t3.250\t1.000\t2.000\t12.3"; },
      {":8", "cut", "'12.3'"}, Errc::kTruncated);
  return all;
}

TEST(TsvRecording, NamesEachDefectWithFileLineAndColumn) {
  for (const auto& defect : defects()) {
    const auto recording = parse_tsv(defect.file.text(), "trial.tsv");
    ASSERT_FALSE(recording.ok()) << defect.what;
    EXPECT_EQ(recording.error().code, defect.code) << defect.what << ": " << recording.error().detail.view();
    for (const auto& part : defect.told) {
      EXPECT_NE(recording.error().detail.view().find(part), std::string_view::npos)
          << defect.what << " should tell " << part << ": " << recording.error().detail.view();
    }
  }
}

TEST(TsvRecording, NeverTakesACutExportForSomethingElse) {
  // Ends in a missing marker: a cut that only takes away the last `nan` changes nothing and may pass.
  const std::string text = Export{}.text();
  std::size_t passed = 0;
  for (std::size_t size = 0; size < text.size(); ++size) {
    const auto recording = parse_tsv(text.substr(0, size), "trial.tsv");
    if (!recording) continue;
    ++passed;
    expect_the_example(*recording);
    EXPECT_GE(size + 4, text.size()) << "cut behind byte " << size;
  }
  EXPECT_LE(passed, 2U);
  std::string visible = Export{}.text();
  visible = replace_all(visible, "nan\tnan\tnan", "1.250\t2.250\t3.250");
  for (std::size_t size = 0; size + 1 < visible.size(); ++size) {
    EXPECT_FALSE(parse_tsv(visible.substr(0, size), "trial.tsv").ok()) << "cut behind byte " << size;
  }
}

Recording random_recording(std::size_t markers, std::size_t frames, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> position_m(-3.0, 3.0);
  std::bernoulli_distribution visible(0.9);
  Recording recording;
  recording.rate_hz = 59.94;
  recording.time_stamp = "2021-08-26, 15:19:24.317";
  for (std::size_t i = 0; i < markers; ++i) recording.marker_names.push_back("marker " + std::to_string(i));
  for (std::size_t k = 0; k < frames; ++k) {
    recording.frames.emplace_back(markers);
    for (auto& marker : recording.frames.back()) {
      if (visible(random)) marker = {{position_m(random), position_m(random), position_m(random)}, true};
    }
  }
  return recording;
}

TEST(TsvRecording, ReadsBackWhatItWritesWithinHalfAMicrometre) {
  for (const std::size_t markers : {std::size_t{1}, std::size_t{13}, kMaxRecordedMarkers}) {
    const auto written = random_recording(markers, 50, /*seed=*/17);
    const auto text = format_tsv(written);
    ASSERT_TRUE(text.ok()) << text.error().detail.c_str();
    EXPECT_EQ(text->find('\n'), text->find("\r\n") + 1);
    const auto read = parse(*text);
    EXPECT_EQ(read.rate_hz, written.rate_hz);
    EXPECT_EQ(read.marker_names, written.marker_names);
    EXPECT_EQ(read.time_stamp, written.time_stamp);
    ASSERT_EQ(read.frames.size(), written.frames.size());
    for (std::size_t k = 0; k < read.frames.size(); ++k) {
      for (std::size_t i = 0; i < markers; ++i) {
        ASSERT_EQ(read.frames[k][i].visible, written.frames[k][i].visible);
        if (!read.frames[k][i].visible) continue;
        ASSERT_LE((read.frames[k][i].p_W - written.frames[k][i].p_W).cwiseAbs().maxCoeff(), 0.5e-6 + 1e-12);
      }
    }
    EXPECT_EQ(*format_tsv(read), *text) << "writing is stable";
  }
}

TEST(TsvRecording, RefusesToWriteWhatCouldNotBeReadBack) {
  const auto refuses = [](auto spoil) {
    auto recording = random_recording(3, 2, /*seed=*/1);
    recording.frames[1][1] = {{0.1, 0.2, 0.3}, true};
    spoil(recording);
    const auto text = format_tsv(recording);
    return !text.ok() && text.error().code == Errc::kInvalidArgument;
  };
  EXPECT_FALSE(refuses([](Recording&) {}));
  EXPECT_TRUE(refuses([](Recording& r) { r.rate_hz = 0.0; }));
  EXPECT_TRUE(refuses([](Recording& r) { r.rate_hz = std::nan(""); }));
  EXPECT_TRUE(refuses([](Recording& r) { r.marker_names.pop_back(); }));
  EXPECT_TRUE(refuses([](Recording& r) { r.marker_names[0] = "a\tb"; }));
  EXPECT_TRUE(refuses([](Recording& r) { r.marker_names[0] = " a"; }));
  EXPECT_TRUE(refuses([](Recording& r) { r.marker_names[0] = ""; }));
  EXPECT_TRUE(refuses([](Recording& r) { r.marker_names[0] = r.marker_names[1]; }));
  EXPECT_TRUE(refuses([](Recording& r) { r.marker_names.clear(); }));
  EXPECT_TRUE(refuses([](Recording& r) { r.time_stamp = "today\n"; }));
  EXPECT_TRUE(refuses([](Recording& r) { r.frames[1].pop_back(); }));
  EXPECT_TRUE(refuses([](Recording& r) { r.frames[1][1].p_W.y() = std::nan(""); }));
  EXPECT_TRUE(refuses([](Recording& r) { r.frames[1][1].p_W.z() = 1e9; }));
}

TEST(TsvRecording, NamesAllMissingMarkersAndTheMostSimilarOnes) {
  Recording recording;
  recording.source = "trial.tsv";
  recording.marker_names = {"Hand_Top", "thumb-tip", "pillow_left"};
  EXPECT_TRUE(require_markers(recording, {"Hand_Top", "pillow_left"}).ok());
  const auto status = require_markers(recording, {"hand_top", "thumb_tip", "elbow", "pillow_left"});
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, Errc::kNotFound);
  for (const char* part :
       {"trial.tsv", "'hand_top' (similar: 'Hand_Top')", "'thumb_tip' (similar: 'thumb-tip')", "'elbow'"}) {
    EXPECT_NE(status.error().detail.view().find(part), std::string_view::npos) << status.error().detail.view();
  }
  EXPECT_EQ(status.error().detail.view().find("pillow_left"), std::string_view::npos);
}

TEST(TsvRecording, TellsHowManyMoreMarkersAreMissingWhenTheyDoNotFit) {
  Recording recording;
  recording.source = "trial.tsv";
  std::vector<std::string> names;
  for (int i = 0; i < 40; ++i) names.push_back("some_marker_" + std::to_string(i));
  const auto status = require_markers(recording, names);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().detail.view().find(" more"), std::string_view::npos) << status.error().detail.view();
}

/// A directory of its own that vanishes with the test.
class TsvFile : public ::testing::Test {
 protected:
  TsvFile() {
    std::string pattern = (std::filesystem::temp_directory_path() / "embody-tsv-XXXXXX").string();
    directory_ = ::mkdtemp(pattern.data());
  }
  ~TsvFile() override { std::filesystem::remove_all(directory_); }
  std::string path(const char* name) const { return (directory_ / name).string(); }
  std::filesystem::path directory_;
};

TEST_F(TsvFile, IsReadBackAsWritten) {
  const auto written = random_recording(5, 20, /*seed=*/2);
  ASSERT_TRUE(save_tsv(written, path("a.tsv")).ok());
  ASSERT_TRUE(save_tsv(written, path("a.tsv")).ok()) << "replaces";
  const auto read = load_tsv(path("a.tsv"));
  ASSERT_TRUE(read.ok()) << read.error().detail.c_str();
  EXPECT_EQ(read->frames.size(), 20U);
  EXPECT_EQ(read->source, path("a.tsv"));
}

TEST_F(TsvFile, IsRefusedWithItsNameWhenItCannotBeRead) {
  const auto absent = load_tsv(path("absent.tsv"));
  ASSERT_FALSE(absent.ok());
  EXPECT_EQ(absent.error().code, Errc::kNotFound);
  EXPECT_NE(absent.error().detail.view().find("absent.tsv"), std::string_view::npos);
  EXPECT_EQ(load_tsv(directory_.string()).error().code, Errc::kInvalidArgument);
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  EXPECT_EQ(load_tsv(path("pipe")).error().code, Errc::kInvalidArgument) << "and does not hang";
  EXPECT_EQ(save_tsv(random_recording(1, 1, /*seed=*/1), path("no/such/folder.tsv")).error().code, Errc::kNotFound);
  EXPECT_EQ(save_tsv(random_recording(1, 1, /*seed=*/1), "/dev/full").error().code, Errc::kIo);
}

TEST_F(TsvFile, IsRefusedBeyondTheSizeLimitWithoutBeingRead) {
  std::ofstream(path("huge.tsv")).put('\n');
  std::error_code failure;
  std::filesystem::resize_file(path("huge.tsv"), kMaxTsvBytes + 1, failure);
  if (failure) GTEST_SKIP() << "this file system has no sparse files of 2 GiB";
  EXPECT_EQ(load_tsv(path("huge.tsv")).error().code, Errc::kUnsupported);
}

TEST(TsvRecording, ReadsTheRealRecording) {
  const std::string path = EMBODY_SOURCE_DIR "/../shared/data/small_pillow.tsv";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "the real recording is not at " << path;
  const auto recording = load_tsv(path);
  ASSERT_TRUE(recording.ok()) << recording.error().detail.c_str();
  EXPECT_EQ(recording->rate_hz, 100.0);
  ASSERT_EQ(recording->frames.size(), 3000U);
  ASSERT_EQ(recording->marker_names.size(), 21U);
  EXPECT_EQ(recording->marker_names.front(), "hand_top");
  EXPECT_EQ(recording->marker_names.back(), "pillow_right");
  EXPECT_TRUE(recording->frames[0][0].p_W.isApprox(Eigen::Vector3d(0.110406, 0.135075, 0.460584), 1e-9));
  std::vector<std::size_t> missing(21, 0);
  for (const auto& frame : recording->frames) {
    for (std::size_t i = 0; i < frame.size(); ++i) missing[i] += frame[i].visible ? 0 : 1;
  }
  for (std::size_t i = 0; i < missing.size(); ++i) {
    EXPECT_EQ(missing[i], recording->marker_names[i] == "thumb_tip" ? 175U : 0U) << recording->marker_names[i];
  }
  const auto again = parse_tsv(*format_tsv(*recording), "again");
  ASSERT_TRUE(again.ok()) << again.error().detail.c_str();
  EXPECT_EQ(*format_tsv(*again), *format_tsv(*recording));
}

}  // namespace
}  // namespace embody::recording
