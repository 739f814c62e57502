// Round trips of the text formats, and what their readers say of damage.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "daemon/convert/trajectory_columns.hpp"
#include "daemon/convert/trajectory_csv.hpp"
#include "daemon/convert/trajectory_json.hpp"
#include "tests/unit/convert/random_trajectory.hpp"

namespace embody::convert {
namespace {

using test::random_trajectory;

struct Format {
  const char* name;
  std::function<std::string(const Trajectory&)> write;
  std::function<Result<Trajectory>(std::string_view)> read;
};

std::vector<Format> formats() {
  return {{"csv", [](const Trajectory& t) { return format_csv(t, ','); },
           [](std::string_view text) { return parse_csv(text, "out"); }},
          {"tsv", [](const Trajectory& t) { return format_csv(t, '\t'); },
           [](std::string_view text) { return parse_csv(text, "out"); }},
          {"json", format_json, [](std::string_view text) { return parse_json(text, "out"); }}};
}

Trajectory example() {
  Trajectory trajectory = random_trajectory(60, 100.0, 1);
  trajectory.label = "grasp, then lift";
  trajectory.object_markers = {"pillow_top", "pillow_left", "pillow_right"};
  trajectory.rows[0] = TrajectoryRow{};  // nothing known
  trajectory.q[0] = trajectory.q[1] = std::nan("");
  trajectory.rows[3].p_m = {1.23456789e-12, -9876.54321, 0.0};
  return trajectory;
}

/// Equal up to nine significant digits.
void expect_equal(double a, double b) {
  if (std::isnan(b)) {
    EXPECT_TRUE(std::isnan(a));
  } else {
    EXPECT_NEAR(a, b, 6e-9 * std::abs(b));
  }
}

TEST(TrajectoryText, ComesBackAsItWasInEveryFormat) {
  const Trajectory before = example();
  for (const Format& format : formats()) {
    SCOPED_TRACE(format.name);
    const Result<Trajectory> after = format.read(format.write(before));
    ASSERT_TRUE(after.ok()) << after.error().detail.view();
    EXPECT_EQ(after->source, before.source);
    EXPECT_EQ(after->label, before.label);
    EXPECT_EQ(after->hand, before.hand);
    EXPECT_EQ(after->object_markers, before.object_markers);
    EXPECT_EQ(after->first_frame, before.first_frame);
    EXPECT_EQ(after->last_frame, before.last_frame);
    EXPECT_EQ(after->rate_hz, before.rate_hz);
    ASSERT_EQ(column_names(*after), column_names(before));
    ASSERT_EQ(after->rows.size(), before.rows.size());
    std::vector<double> a, b;
    for (std::size_t i = 0; i < before.rows.size(); ++i) {
      row_values(*after, i, a);
      row_values(before, i, b);
      ASSERT_EQ(a.size(), b.size());
      for (std::size_t k = 0; k < a.size(); ++k) expect_equal(a[k], b[k]);
    }
    EXPECT_EQ(format.write(*after), format.write(before)) << "writing is idempotent";
  }
}

TEST(TrajectoryText, NamesColumnsWithUnits) {
  const std::vector<std::string> expected{"time_s", "x_m", "y_m",         "z_m",      "qw",   "qx",
                                          "qy",     "qz",  "a_joint_rad", "slider_m", "valid"};
  EXPECT_EQ(column_names(example()), expected);
}

TEST(TrajectoryText, SaysWhatItsFramesAre) {
  Trajectory trajectory = example();
  for (const Format& format : formats()) {
    EXPECT_NE(format.write(trajectory).find("P in O"), std::string::npos) << format.name;
    EXPECT_NE(format.write(trajectory).find("root link"), std::string::npos) << format.name;
  }
  trajectory.object_markers.clear();
  for (const Format& format : formats()) {
    EXPECT_NE(format.write(trajectory).find("P in W: the motion-capture world"), std::string::npos) << format.name;
  }
}

TEST(TrajectoryText, KeepsControlCharactersOutOfTheHeader) {
  Trajectory trajectory = example();
  trajectory.label = "two\nlines\r\x1b[2J";
  for (const Format& format : formats()) {
    const std::string text = format.write(trajectory);
    EXPECT_EQ(text.find('\x1b'), std::string::npos) << format.name;
    EXPECT_TRUE(format.read(text).ok()) << format.name;
  }
}

TEST(TrajectoryText, IsReadWithWindowsLineEnds) {
  std::string text;
  for (const char c : format_csv(example(), ',')) text += c == '\n' ? std::string("\r\n") : std::string(1, c);
  const auto trajectory = parse_csv(text, "out.csv");
  ASSERT_TRUE(trajectory.ok()) << trajectory.error().detail.view();
  EXPECT_EQ(trajectory->rows.size(), example().rows.size());
  EXPECT_EQ(trajectory->source, "trial.tsv");
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

void expect_error(const Result<Trajectory>& result, const std::vector<std::string>& told) {
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, Errc::kMalformed);
  for (const std::string& words : told) {
    EXPECT_NE(std::string(result.error().detail.view()).find(words), std::string::npos)
        << words << " not in: " << result.error().detail.view();
  }
}

TEST(TrajectoryText, TellsLineAndColumnOfWhatIsWrong) {
  const std::string csv = format_csv(random_trajectory(3, 100.0, 2), ',');
  const auto lines = static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n'));
  const std::string second = "out.csv:" + std::to_string(lines - 1);
  expect_error(parse_csv(replaced(csv, "\n0.11,", "\nx,"), "out.csv"), {second, "'time_s'", "'x'"});
  expect_error(parse_csv(replaced(csv, "\n0.11,", "\n0.11,0,"), "out.csv"), {second, "more numbers"});
  expect_error(parse_csv(replaced(csv, "\n0.11,", "\n"), "out.csv"), {second, "'valid' is missing"});
  expect_error(parse_csv(replaced(csv, ",qw,", ",w,"), "out.csv"), {"column 5", "'qw'"});
  expect_error(parse_csv(replaced(csv, "slider_m", "slider"), "out.csv"), {"slider", "_rad"});
  expect_error(parse_csv(replaced(csv, "rate_hz: 100", "rate_hz: fast"), "out.csv"), {"out.csv:", "rate_hz"});
  expect_error(parse_csv("", "out.csv"), {"no line of column names"});

  const std::string json = format_json(random_trajectory(3, 100.0, 2));
  expect_error(parse_json(replaced(json, "    [0.11, ", "    ["), "out.json"), {"row 2"});
  expect_error(parse_json(replaced(json, "    [0.11, ", "    [\"a\", "), "out.json"), {"row 2", "time_s"});
  expect_error(parse_json(replaced(json, "\"rows\"", "\"lines\""), "out.json"), {"no \"rows\""});
  expect_error(parse_json(json.substr(0, json.size() / 2), "out.json"), {"no JSON"});
  for (const char* text : {"[]", "1", "{\"about\": 1, \"columns\": [], \"rows\": []}",
                           "{\"about\": {}, \"columns\": [1], \"rows\": []}"}) {
    EXPECT_FALSE(parse_json(text, "out.json").ok()) << text;
  }
}

}  // namespace
}  // namespace embody::convert
