// The configuration as its users meet it: files, messages with line numbers, and the round trip through print_toml().
#include "daemon/app/config.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "daemon/app/config_io.hpp"
#include "tests/unit/app/key_visitors.hpp"

namespace embody::config {
namespace {

namespace fs = std::filesystem;

const std::string kShipped = std::string(EMBODY_SOURCE_DIR) + "/config/embody.toml";

std::string text_of(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

EmbodyConfig shipped() {
  auto config = load_config(kShipped);
  EXPECT_TRUE(config.ok()) << config.error().detail.view();
  return config.ok() ? *config : EmbodyConfig{};
}

/// Message for the text after "schema = 1" on line 1.
std::string message(const std::string& text) {
  const auto config = parse_config("schema = 1\n" + text, "embody.toml", "/nonexistent");
  return config.ok() ? "accepted" : std::string(config.error().detail.view());
}

/// A folder of files that disappears with the test.
class ConfigFiles : public ::testing::Test {
 protected:
  ConfigFiles() {
    char name[] = "/tmp/embody-config-XXXXXX";
    folder_ = ::mkdtemp(name);
  }
  ~ConfigFiles() override { fs::remove_all(folder_); }
  std::string write(const std::string& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  static std::string load_message(const std::string& path) {
    const auto config = load_config(path);
    return config.ok() ? "accepted" : std::string(config.error().detail.view());
  }
  fs::path folder_;
};

TEST(Config, TheShippedFileIsAcceptedAndItsFilesAreNoted) {
  const EmbodyConfig config = shipped();
  ASSERT_EQ(config.files.size(), 4u);
  EXPECT_EQ(config.files[0], kShipped);
  EXPECT_EQ(config.hand.embodiment.name, "mia");
}

TEST(Config, TheShippedFilesSayWhatTheDefaultsAre) {
  EmbodyConfig defaults;
  const EmbodyConfig config = shipped();
  defaults.hand = config.hand;  // comes from the hand file only
  EXPECT_EQ(print_toml(config), print_toml(defaults));
}

TEST(Config, TheFlangeMountingTurnsTheHandAsDocumented) {
  const auto& r = CellConfig{}.r_EP_rad;
  const Eigen::Matrix3d R_EP = math::exp_so3({r[0], r[1], r[2]});
  EXPECT_TRUE(R_EP.col(0).isApprox(Eigen::Vector3d::UnitX(), 1e-12));   // x_P is x_E
  EXPECT_TRUE(R_EP.col(1).isApprox(Eigen::Vector3d::UnitZ(), 1e-12));   // y_P is z_E
  EXPECT_TRUE(R_EP.col(2).isApprox(-Eigen::Vector3d::UnitY(), 1e-12));  // z_P is -y_E
}

TEST(Config, PrintedTextParsesBackToTheSameValues) {
  const std::string printed = print_toml(shipped());
  const auto again = parse_config(printed, "printed", "/nonexistent");
  ASSERT_TRUE(again.ok()) << again.error().detail.view();
  EXPECT_EQ(print_toml(*again), printed);
}

TEST(Config, RandomValuesSurviveTheRoundTripBitForBit) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    EmbodyConfig config = shipped();
    test::Randomiser randomiser(seed);
    config.visit(randomiser);
    const std::string printed = print_toml(config);
    const auto again = parse_config(printed, "printed", "/nonexistent");
    ASSERT_TRUE(again.ok()) << "seed " << seed << ": " << again.error().detail.view();
    test::Collector before, after;
    config.visit(before);
    EmbodyConfig copy = *again;
    copy.visit(after);
    ASSERT_EQ(before.numbers, after.numbers) << "seed " << seed;
    ASSERT_EQ(before.texts, after.texts) << "seed " << seed;
  }
}

TEST(Config, EveryNumberIsRefusedBeyondEitherEndOfItsRange) {
  test::KeyLister lister;
  EmbodyConfig{}.visit(lister);
  ASSERT_GT(lister.ranged.size(), 50u);
  for (const auto& key : lister.ranged) {
    for (const double value : {key.range.max + 1, key.range.min - 1}) {
      const std::string text = message(test::assignment(key, test::number(value, key.whole)));
      EXPECT_NE(text.find("embody.toml:3: [" + key.table + "] " + key.name), std::string::npos) << text;
      EXPECT_NE(text.find("out of range"), std::string::npos) << text;
      EXPECT_NE(text.find(unit_of(key.name)), std::string::npos) << text;
    }
  }
}

TEST(Config, EveryKeyRefusesAnotherType) {
  test::KeyLister lister;
  EmbodyConfig{}.visit(lister);
  for (const auto& key : lister.all) {
    const std::string text = message("[" + key.table + "]\n" + key.name + " = 1979-05-27\n");
    EXPECT_NE(text.find("embody.toml:3: [" + key.table + "] " + key.name + " must be "), std::string::npos) << text;
    EXPECT_NE(text.find("not a date or time"), std::string::npos) << text;
  }
}

TEST(Config, NumbersAreFinite) {
  for (const char* value : {"nan", "-nan", "inf", "-inf"}) {
    const std::string text = message(std::string("[arm.limits]\nspeed_m_s = ") + value + "\n");
    EXPECT_EQ(text, "embody.toml:3: [arm.limits] speed_m_s must be finite, not nan or inf");
  }
}

TEST(Config, ARangeErrorSaysValueBoundsAndUnit) {
  EXPECT_EQ(message("[arm.limits]\nspeed_m_s = 12.5\n"),
            "embody.toml:3: [arm.limits] speed_m_s is 12.5, out of range: 0.001 to 3 m/s");
  EXPECT_EQ(message("[cell]\np_WB_m = [0, 0, 1000]\n"),
            "embody.toml:3: [cell] p_WB_m entry 3 is 1000, out of range: -100 to 100 m");
}

TEST(Config, AnUnknownKeyIsRefusedWithTheNearestName) {
  EXPECT_EQ(message("[arm.limits]\n\nmax_speed_m_s = 1.0\n"),
            "embody.toml:4: unknown key 'max_speed_m_s' in [arm.limits]; did you mean 'speed_m_s'?");
  EXPECT_EQ(message("[safty]\n"), "embody.toml:2: unknown key 'safty' at the top of the file; did you mean 'safety'?");
  EXPECT_EQ(message("[tracker]\nhold_after_ms = 5\n"),
            "embody.toml:3: unknown key 'hold_after_ms' in [tracker]; it belongs in [safety]");
  EXPECT_EQ(message("[log]\nxyzzyxyzzy = 5\n"), "embody.toml:3: unknown key 'xyzzyxyzzy' in [log]");
}

TEST(Config, AnUnknownNameListsTheKnownOnes) {
  EXPECT_EQ(message("[arm]\nclutch = \"manual\"\n"),
            "embody.toml:3: [arm] clutch must be \"absolute\" or \"relative\", not \"manual\"");
}

TEST(Config, ListsOfFixedLengthSayHowMany) {
  EXPECT_EQ(message("[arm.limits]\njoint_speed_rad_s = [1, 1]\n"),
            "embody.toml:3: [arm.limits] joint_speed_rad_s needs 6 numbers, has 2");
}

TEST(Config, SyntaxErrorsHaveLineAndColumn) {
  const std::string text = message("[tracker]\nport = = 3\n");
  EXPECT_EQ(text.rfind("embody.toml:3:8: ", 0), 0u) << text;
}

TEST(Config, AKeyThatIsGivenTwiceIsRefused) {
  const std::string text = message("[tracker]\nport = 1\nport = 2\n");
  EXPECT_EQ(text.rfind("embody.toml:4:", 0), 0u) << text;
}

TEST(Config, TheFirstOfSeveralProblemsIsReportedWithTheirNumber) {
  const std::string text = message("[tracker]\nport = 0\n[log]\nlevel = \"loud\"\n[dds]\ndomain = 999\n");
  EXPECT_EQ(text.rfind("embody.toml:3: [tracker] port", 0), 0u) << text;
  EXPECT_NE(text.find("(and 2 more)"), std::string::npos) << text;
}

TEST(Config, TheSchemaNumberIsRequiredAndMustBeKnown) {
  const auto missing = parse_config("[log]\n", "embody.toml", "/");
  ASSERT_FALSE(missing.ok());
  EXPECT_NE(missing.error().detail.view().find("start the file with schema = 1"), std::string_view::npos);
  const auto newer = parse_config("schema = 2\n", "embody.toml", "/");
  ASSERT_FALSE(newer.ok());
  EXPECT_NE(newer.error().detail.view().find("embody.toml:1: schema is 2"), std::string_view::npos);
}

TEST(Config, ValuesThatDoNotFitTogetherAreRefused) {
  EXPECT_NE(message("[arm.limits]\nworkspace_min_m = [0, 0, 2]\n").find("workspace_min_m must be below"),
            std::string::npos);
  EXPECT_NE(message("[safety]\nstop_after_ms = 50\n").find("stop_after_ms must be greater"), std::string::npos);
  EXPECT_NE(message("[realtime.priority]\narm = 60\n").find("watchdog must have"), std::string::npos);
  EXPECT_NE(message("[links]\nretry_first_ms = 5000\n").find("retry_longest_ms"), std::string::npos);
  EXPECT_NE(message("[glove.back]\ntop = \"elbow\"\n").find("'elbow' is not in names"), std::string::npos);
  EXPECT_NE(message("[glove]\nfinger_markers = [{marker = \"thumb_tip\"}, {marker = \"index_tip\"}]\n")
                .find("'index_tip' shows a point that another"),
            std::string::npos);
  EXPECT_NE(message("[hand]\nfile = \"\"\n").find("urdf is missing"), std::string::npos);
  EXPECT_NE(message("[hand]\nmotor_lower_rad = [0]\n").find("one number per entry of motors"), std::string::npos);
}

TEST(Config, TextsAreBoundedAndPrintable) {
  EXPECT_NE(message("[arm]\nhost = \"" + std::string(300, 'x') + "\"\n").find("longer than 256"), std::string::npos);
  EXPECT_NE(message("[arm]\nhost = \"a\\u0007b\"\n").find("control character"), std::string::npos);
}

TEST(Config, MessagesFitAndKeepTheFileNameWhateverTheInput) {
  const std::string text = message("[arm]\n" + std::string(5000, 'k') + " = 1\n");
  EXPECT_EQ(text.rfind("embody.toml:3: unknown key 'kkkk", 0), 0u) << text;
}

TEST(Config, DeepNestingIsRefusedBeforeItExhaustsTheStack) {
  const auto dotted = [](int count) {
    std::string text = "a";
    for (int i = 0; i < count; ++i) text += ".a";
    return text;
  };
  EXPECT_NE(message(dotted(30'000) + " = 1\n").find("more than 4096 dots"), std::string::npos);
  EXPECT_NE(message("[" + dotted(4000) + "]\n").find("unknown key 'a'"), std::string::npos);
  EXPECT_EQ(message("a = " + std::string(50'000, '[')).rfind("embody.toml:2:", 0), 0u);
}

TEST_F(ConfigFiles, AnIncludedFileIsFoundBesideTheFileThatNamesIt) {
  write("gloves/mine.toml",
        "names = [\"a\", \"b\", \"c\"]\nfinger_markers = []\nback = {top = \"a\", left = \"b\", "
        "right = \"c\"}\n");
  const auto config = load_config(write("embody.toml", "schema = 1\n[glove]\nfile = \"gloves/mine.toml\"\n"));
  ASSERT_TRUE(config.ok()) << config.error().detail.view();
  EXPECT_EQ(config->glove.names, (std::vector<std::string>{"a", "b", "c"}));
  EXPECT_EQ(config->glove.back.left, "b");
}

TEST_F(ConfigFiles, OwnKeysOfATableWinOverItsFile) {
  write("s.toml", "skeleton = \"B\"\nshape = [0.1, 0, 0, 0, 0, 0, 0, 0, 0, 0]\n");
  const auto config = load_config(write("embody.toml", "schema = 1\n[subject]\nskeleton = \"A\"\nfile = \"s.toml\"\n"));
  ASSERT_TRUE(config.ok()) << config.error().detail.view();
  EXPECT_EQ(config->subject.skeleton, Skeleton::kA);
  EXPECT_EQ(config->subject.shape[0], 0.1);
}

TEST_F(ConfigFiles, AnErrorInAnIncludedFileNamesThatFileAndLine) {
  const std::string included = write("s.toml", "schema = 1\nskelton = \"B\"\n");
  EXPECT_EQ(load_message(write("embody.toml", "schema = 1\n[subject]\nfile = \"s.toml\"\n")),
            included + ":2: unknown key 'skelton' at the top of the file; did you mean 'skeleton'?");
  write("s.toml", "shape = [");
  EXPECT_EQ(load_message((folder_ / "embody.toml").string()).rfind(included + ":1:", 0), 0u);
}

TEST_F(ConfigFiles, AMissingIncludeIsReportedAtTheKeyThatNamesIt) {
  const std::string main = write("embody.toml", "schema = 1\n[subject]\nfile = \"nobody.toml\"\n");
  const std::string text = load_message(main);
  EXPECT_EQ(text.rfind(main + ":3: [subject] file: \"nobody.toml\" is not in " + folder_.string(), 0), 0u) << text;
}

TEST_F(ConfigFiles, AnIncludedFileIncludesNothing) {
  write("s.toml", "file = \"s.toml\"\n");
  const std::string text = load_message(write("embody.toml", "schema = 1\n[subject]\nfile = \"s.toml\"\n"));
  EXPECT_NE(text.find("cannot include another"), std::string::npos) << text;
}

TEST_F(ConfigFiles, WhatIsNoSmallRegularFileIsRefused) {
  EXPECT_NE(load_message(folder_.string()).find("is not a file"), std::string::npos);
  EXPECT_NE(load_message("/dev/zero").find("is not a file"), std::string::npos);
  EXPECT_NE(load_message((folder_ / "none.toml").string()).find("No such file"), std::string::npos);
  EXPECT_NE(load_message(write("big.toml", std::string(kMaxConfigBytes + 1, '#'))).find("has more than"),
            std::string::npos);
}

TEST_F(ConfigFiles, TheFileIsSearchedInTheDocumentedOrder) {
  const std::string named = write("a.toml", "schema = 1\n");
  const std::string from_environment = write("b.toml", "schema = 1\n");
  ASSERT_EQ(::setenv("EMBODY_CONFIG", from_environment.c_str(), 1), 0);
  EXPECT_EQ(find_config(named)->string(), named);
  EXPECT_EQ(find_config("")->string(), from_environment);
  ::setenv("EMBODY_CONFIG", (folder_ / "none.toml").c_str(), 1);
  EXPECT_FALSE(find_config("").ok()) << "a named file that is missing is not replaced by another";
  ::unsetenv("EMBODY_CONFIG");
  if (fs::exists("/etc/embody/embody.toml")) GTEST_SKIP() << "this computer has its own /etc/embody/embody.toml";
  EXPECT_EQ(find_config("")->string(), kShipped);
}

TEST(ConfigDocumentation, TheDefaultsInThePageAreTheDefaultsInForce) {
  const std::string page = document_config();
  std::istringstream lines(print_toml(EmbodyConfig{}));
  std::size_t keys = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("[[glove.finger_markers]]", 0) == 0) {  // a list of tables: the page counts its entries
      while (std::getline(lines, line) && !line.empty()) continue;
    }
    const auto equals = line.find(" = ");
    if (equals == std::string::npos) continue;
    ++keys;
    const std::string key = line.substr(0, equals), value = line.substr(equals + 3);
    if (key == "file") continue;                                            // printed values need no file
    if (key == "markers" || key == "couplings" || key == "pads") continue;  // empty lists of tables
    EXPECT_NE(page.find("| `" + key + "` | `" + value + "` |"), std::string::npos) << line;
  }
  EXPECT_GT(keys, 80u);
}

TEST(ConfigDocumentation, TheCommittedPageIsCurrent) {
  const std::string path = std::string(EMBODY_SOURCE_DIR) + "/docs/config.md";
  if (std::getenv("EMBODY_REFRESH_DOCS") != nullptr) std::ofstream(path) << document_config();
  EXPECT_TRUE(text_of(path) == document_config())
      << path << " is out of date; refresh it with:\n  EMBODY_REFRESH_DOCS=1 " << EMBODY_BINARY_DIR
      << "/tests/unit/app/config_test --gtest_filter=ConfigDocumentation.TheCommittedPageIsCurrent";
}

TEST(SlowSensor, GetsTheTimesThatItsFramePeriodNeedsAndAFastOneChangesNothing) {
  EmbodyConfig config;
  EXPECT_EQ(print_toml(adapted_to_sensor(config)), print_toml(config)) << "a marker glove";
  config.tracker.driver = TrackerDriver::kLandmarks;
  for (const double rate_hz : {10.0, 25.0, 30.0, 60.0, 120.0}) {
    config.tracker.landmarks.rate_hz = rate_hz;
    const EmbodyConfig adapted = adapted_to_sensor(config);
    EXPECT_GE(static_cast<double>(adapted.arm.resample_delay.count()), 1.5e3 / rate_hz);
    EXPECT_GE(static_cast<double>(adapted.safety.hold_after.count()), 3e3 / rate_hz);
    EXPECT_LE(adapted.arm.resample_delay, milliseconds(200)) << "the range of the key";
    EXPECT_LE(adapted.safety.hold_after, milliseconds(1000));
    EXPECT_EQ(adapted.safety.problem(), "");
    EXPECT_EQ(print_toml(adapted_to_sensor(adapted)), print_toml(adapted)) << "once is enough";
  }
  config.tracker.landmarks.rate_hz = 120.0;
  EXPECT_EQ(print_toml(adapted_to_sensor(config)), print_toml(config));
}

}  // namespace
}  // namespace embody::config
