// Wrong recordings, wrong configurations, missing devices: one clear sentence and the documented exit code.
#include <algorithm>
#include <fstream>
#include <sstream>

#include "daemon/control/exit_code.hpp"
#include "tests/integration/system/rig.hpp"

namespace embody::test {
namespace {

std::string shipped_recording() {
  std::ifstream in(std::string(EMBODY_SOURCE_DIR) + "/config/recordings/demo.tsv", std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

void replace_all(std::string& text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
}

std::ptrdiff_t lines(const std::string& text) {
  return std::count(text.begin(), text.end(), '\n');
}

Finished play(const TemporaryFolder& folder, const std::string& text) {
  folder.write("bad.tsv", text);
  return run_program("embody-sim", {"run", folder.file("bad.tsv")});
}

TEST(BadRecording, WithAWrongMarkerNameIsRefusedWithTheNearestName) {
  const TemporaryFolder folder;
  std::string text = shipped_recording();
  replace_all(text, "index_tip", "index_tpi");
  const Finished result = play(folder, text);
  EXPECT_NE(result.exit_code, 0);
  EXPECT_NE(result.errors.find("index_tip"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("index_tpi"), std::string::npos) << result.errors;
  EXPECT_EQ(lines(result.errors), 1) << result.errors;
}

TEST(BadRecording, WithAMissingColumnIsRefusedWithItsLine) {
  const TemporaryFolder folder;
  std::string text = shipped_recording();
  const std::size_t row = text.find("\r\n100\t") + 2;
  text.erase(text.rfind('\t', text.find("\r\n", row)),
             text.find("\r\n", row) - text.rfind('\t', text.find("\r\n", row)));
  const Finished result = play(folder, text);
  EXPECT_NE(result.exit_code, 0);
  EXPECT_NE(result.errors.find("bad.tsv"), std::string::npos) << result.errors;
  EXPECT_EQ(lines(result.errors), 1) << result.errors;
}

TEST(BadRecording, ThatIsTruncatedIsRefused) {
  const TemporaryFolder folder;
  const std::string text = shipped_recording();
  const Finished result = play(folder, text.substr(0, text.size() * 2 / 3));
  EXPECT_NE(result.exit_code, 0);
  EXPECT_NE(result.errors.find("bad.tsv"), std::string::npos) << result.errors;
  EXPECT_EQ(lines(result.errors), 1) << result.errors;
}

TEST(BadRecording, ThatDoesNotExistIsRefused) {
  const Finished result = run_program("embody-sim", {"run", "/nowhere/none.tsv"});
  EXPECT_NE(result.exit_code, 0);
  EXPECT_NE(result.errors.find("/nowhere/none.tsv"), std::string::npos) << result.errors;
}

Finished start_with(const std::string& toml) {
  const TemporaryFolder folder;
  folder.write("embody.toml", toml);
  return run_program("embodyd", {"--config", folder.file("embody.toml")});
}

TEST(BadConfiguration, UnknownKeyNamesFileLineAndTheNearestKey) {
  const Finished result = start_with("schema = 1\n[arm.limits]\nspeed_mm_s = 250\n");
  EXPECT_EQ(result.exit_code, kExitConfiguration);
  EXPECT_NE(result.errors.find("embody.toml:3"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("speed_m_s"), std::string::npos) << result.errors;
  EXPECT_EQ(lines(result.errors), 1) << result.errors;
}

TEST(BadConfiguration, AValueInAWrongUnitIsOutOfRange) {
  const Finished result = start_with("schema = 1\n[arm.limits]\nspeed_m_s = 250\n");
  EXPECT_EQ(result.exit_code, kExitConfiguration);
  EXPECT_NE(result.errors.find("m/s"), std::string::npos) << result.errors;
}

TEST(BadConfiguration, AHandThatTheDriverDoesNotMoveOrOfTheOtherSideIsRefused) {
  const TemporaryFolder folder;
  folder.write("shadow.toml", "schema = 1\n[hand]\nfile = \"hands/shadow.toml\"\n");
  const Finished shadow = run_program("embodyd", {"--config", folder.file("shadow.toml")});
  EXPECT_EQ(shadow.exit_code, kExitConfiguration);
  EXPECT_NE(shadow.errors.find("j_mrl_fle; the hand file of \"shadow\" has others"), std::string::npos)
      << shadow.errors;
  folder.write("left.toml", "schema = 1\n[subject]\nfile = \"subjects/default_left.toml\"\n");
  const Finished left = run_program("embodyd", {"--config", folder.file("left.toml")});
  EXPECT_EQ(left.exit_code, kExitConfiguration);
  EXPECT_NE(left.errors.find("[hand] side is right"), std::string::npos) << left.errors;
}

TEST(BadConfiguration, AFileThatIsNotThereIsSaidSo) {
  const Finished result = run_program("embodyd", {"--config", "/nowhere/embody.toml"});
  EXPECT_EQ(result.exit_code, kExitConfiguration);
  EXPECT_NE(result.errors.find("/nowhere/embody.toml"), std::string::npos) << result.errors;
}

/// A configuration whose devices are not there and that does not wait for them.
std::string nobody_there(const TemporaryFolder& folder) {
  return "schema = 1\n[tracker]\nport = 1\n[arm]\nport = 1\n[hand]\ndevice = \"/dev/none\"\n[links]\non_missing = "
         "\"exit\"\nmissing_timeout_s = 1\n[control]\nsocket = \"" +
         folder.file("control.sock") + "\"\n[dds]\nenabled = false\n";
}

TEST(MissingDevices, AreNamedOneByOneAndEndTheDaemonWhereConfigured) {
  const TemporaryFolder folder;
  folder.write("embody.toml", nobody_there(folder));
  const Finished result = run_program("embodyd", {"--config", folder.file("embody.toml")});
  EXPECT_EQ(result.exit_code, kExitUnavailable);
  for (const char* words : {"tracker is missing", "arm is missing", "hand is missing", "127.0.0.1:1", "/dev/none"}) {
    EXPECT_NE(result.errors.find(words), std::string::npos) << words << " not in\n" << result.errors;
  }
}

TEST(Usage, AnUnknownOptionIsExitCode2) {
  for (const char* name : {"embodyd", "embody-sim", "embodyctl"}) {
    EXPECT_EQ(run_program(name, {"--no-such-option"}).exit_code, kExitUsage) << name;
    const Finished help = run_program(name, {"--help"});
    EXPECT_EQ(help.exit_code, kExitOk) << name;
    EXPECT_NE(help.output.find("--help"), std::string::npos) << name;
    EXPECT_EQ(run_program(name, {"--version"}).exit_code, kExitOk) << name;
  }
}

TEST(Demo, JudgesAShortRunAndLeavesNothingBehind) {
  const TemporaryFolder folder;
  const Finished result = run_program("embodyctl", {"demo", "--duration", "7", "--json", folder.file("demo.json")}, 60);
  const json summary = json::parse(folder.read("demo.json"), nullptr, false);
  ASSERT_TRUE(summary.is_object()) << result.output << result.errors;
  for (const char* key :
       {"frames_sent", "frames_received", "frames_used", "finger_frames", "finger_skipped", "robot_packages",
        "arm_commands", "arm_rate_hz", "hand_rate_hz", "rt_heap_allocations", "latency_us", "marker_residual_mm",
        "arm_error_mm", "arm_error_rad", "hand_error_rad", "path_ratio", "holds", "followed"}) {
    EXPECT_TRUE(summary.contains(key)) << key;
  }
  EXPECT_EQ(result.exit_code, summary["followed"] == true ? kExitOk : kExitNotFollowing) << result.output;
  EXPECT_EQ(summary["frames_sent"], 700);
  for (const char* stage : {"decode", "hand_pose", "phase_wait", "arm", "write", "total", "fingers"}) {
    EXPECT_TRUE(summary["latency_us"].contains(stage)) << stage;
  }
}

TEST(Demo, WithAMissingRecordingSaysSo) {
  const Finished result = run_program("embodyctl", {"demo", "--recording", "/nowhere/none.tsv"});
  EXPECT_NE(result.exit_code, 0);
  EXPECT_NE(result.errors.find("/nowhere/none.tsv"), std::string::npos) << result.errors;
}

}  // namespace
}  // namespace embody::test
