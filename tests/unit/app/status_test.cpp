// Laws of the status: every device has counters, and docs/control.md names what is shown.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>

#include "daemon/app/config_io.hpp"
#include "daemon/app/daemon.hpp"
#include "daemon/app/hand_report.hpp"

namespace embody {
namespace {

using json = nlohmann::ordered_json;
using Names = std::set<std::string>;

const std::string& page() {
  static const std::string text = [] {
    std::ifstream file(EMBODY_SOURCE_DIR "/docs/control.md");
    std::stringstream stream;
    stream << file.rdbuf();
    return stream.str();
  }();
  return text;
}

/// The words between backticks in the first table row after `section` that starts with `first`, without those of
/// `first`.
Names documented(const std::string& section, const std::string& first) {
  const std::size_t begin = page().find("\n| " + first + " |", page().find(section));
  if (begin == std::string::npos) return {};
  const std::size_t start = begin + first.size() + 4;
  const std::string row = page().substr(start, page().find('\n', begin + 1) - start);
  static const std::regex kWord("`([a-z_]+)`");
  Names names;
  for (std::sregex_iterator i(row.begin(), row.end(), kWord), end; i != end; ++i) names.insert((*i)[1]);
  names.erase("rate_hz");  // a key of the configuration
  return names;
}

/// A configuration of which only the drivers matter; nothing is connected.
struct DriverChoice {
  const char* name;  ///< for people
  std::string text;
  const char* tracker_row{"`qualisys`"};
  const char* hand_row{"`mia`"};
};

std::string hand_text(const std::string& file, const std::string& driver, const std::string& more = "") {
  return "[hand]\nfile = \"" EMBODY_SOURCE_DIR "/config/hands/" + file + "\"\ndriver = \"" + driver + "\"\n" + more;
}

std::vector<DriverChoice> driver_choices() {
  const std::string domain = std::to_string(100 + ::getpid() % 100);
  const std::string off = "schema = 1\n[dds]\nenabled = false\n";
  return {
      {"mia", off},
      {"landmarks", off + "[tracker]\ndriver = \"landmarks\"\n", "`landmarks`"},
      {"compact", off + hand_text("mia.toml", "mia", "[hand.mia]\nwire = \"can_compact\"\n"), "`qualisys`",
       "`mia` on `can_compact`"},
      {"robotiq", off + hand_text("robotiq_2f140.toml", "robotiq"), "`qualisys`", "`robotiq`"},
      {"joint_state", "schema = 1\n[dds]\ndomain = " + domain + "\n" + hand_text("robotiq_2f140.toml", "joint_state"),
       "`qualisys`", "`joint_state`"}};
}

Names keys(const json& object) {
  Names names;
  for (const auto& item : object.items()) names.insert(item.key());
  return names;
}

TEST(Status, EveryDeviceHasCountersAndThePageNamesThem) {
  for (const DriverChoice& choice : driver_choices()) {
    SCOPED_TRACE(choice.name);
    const auto config = config::parse_config(choice.text, "test.toml", EMBODY_SOURCE_DIR "/config");
    ASSERT_TRUE(config) << config.error().detail.c_str();
    auto daemon = Daemon::create(*config);
    ASSERT_TRUE(daemon) << daemon.error().detail.c_str();
    const json status = json::parse((*daemon)->status_json());
    const std::array<std::pair<const char*, const char*>, 3> rows{
        {{"tracker", choice.tracker_row}, {"arm", "`ur_rtde`"}, {"hand", choice.hand_row}}};
    for (const auto& [device, row] : rows) {
      SCOPED_TRACE(device);
      const json& counters = status["devices"][device]["counters"];
      ASSERT_TRUE(counters.is_object());
      EXPECT_GE(counters.size(), 6U);
      EXPECT_LE(counters.size(), CounterTable::kCapacity);
      EXPECT_EQ(keys(counters), documented("Counters of the devices", row)) << "docs/control.md, row " << row;
      for (const auto& [name, value] : counters.items()) EXPECT_EQ(value, 0) << name << ": nothing has happened yet";
    }
    EXPECT_TRUE(status["hand"].is_object());
    EXPECT_TRUE(status["hand"].empty()) << "the hand has not answered";
  }
}

TEST(Status, ThePageNamesEveryConditionAndMeasurementOfTheHand) {
  for (const char* condition : kHandConditionNames) {
    EXPECT_NE(page().find("\n| `" + std::string(condition) + "` |"), std::string::npos) << condition;
  }
  HandDeviceState state;
  state.t_arrival = state.telemetry.t_current = state.telemetry.t_force = TimePoint(Duration(1));
  state.joint_count = state.telemetry.current_count = 2;
  state.telemetry.force[2] = {true, 5, -6};
  const std::vector<std::string> joints{"a", "b"};
  const Names row = documented("Result of `status`", "`hand`");
  for (const bool ampere : {false, true}) {
    state.telemetry.current_in_ampere = ampere;
    const json hand = hand_json(state, joints);
    EXPECT_EQ(hand.contains("current_a"), ampere);
    EXPECT_EQ(hand.contains("current_raw"), !ampere) << "raw numbers are no ampere";
    for (const std::string& name : keys(hand)) EXPECT_EQ(row.count(name), 1U) << name;
    EXPECT_EQ(keys(hand["position_rad"]), (Names{"a", "b"}));
    EXPECT_EQ(hand["force_raw"], (json{{"middle", {{"normal", 5}, {"tangential", -6}}}}));
  }
}

TEST(Status, WhatIsNotMeasuredIsAbsentAndBadCountsAreBounded) {
  HandDeviceState state;
  EXPECT_TRUE(hand_json(state, {}).empty());
  state.t_arrival = TimePoint(Duration(1));
  state.joint_count = kMaxHandJoints + 7;
  state.telemetry.current_count = 1000;
  const std::vector<std::string> joints(kMaxHandJoints + 7, "j");
  json hand = hand_json(state, joints);
  EXPECT_FALSE(hand.contains("current_a") || hand.contains("current_raw") || hand.contains("force_raw"));
  state.telemetry.t_current = state.t_arrival;
  EXPECT_TRUE(hand_json(state, joints).contains("current_raw"));
}

}  // namespace
}  // namespace embody
