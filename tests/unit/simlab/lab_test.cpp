// Faults of a whole lab: the list, the check and what happens agree.
#include "daemon/simlab/lab.hpp"

#include <gtest/gtest.h>

#include <regex>
#include <set>

#include "daemon/app/config_io.hpp"

namespace embody::sim {
namespace {

config::EmbodyConfig configured(const std::string& extra) {
  auto config = config::parse_config("schema = 1\n" + extra, "test.toml", EMBODY_SOURCE_DIR "/config");
  EXPECT_TRUE(config.ok()) << config.error().detail.view();
  return *config;
}

LabConfig short_recording() {
  LabConfig lab;
  lab.recording = EMBODY_SOURCE_DIR "/config/recordings/demo.tsv";
  lab.duration_s = 2.0;
  return lab;
}

std::unique_ptr<Lab> make_lab(const std::string& extra = "") {
  auto lab = Lab::create(configured(extra), short_recording());
  EXPECT_TRUE(lab.ok()) << lab.error().detail.view();
  if (!lab) return nullptr;
  EXPECT_TRUE((*lab)->start().ok());
  return std::move(*lab);
}

/// Puts something that fits in the place of each word of a help text.
std::string example(const FaultHelp& help) {
  std::string words = help.words;
  const auto put = [&words](const char* pattern, const char* value) {
    words = std::regex_replace(words, std::regex(pattern), value);
  };
  put("\\bL NEW\\b", "index_tip new_name");
  put("\\bA B\\b", "index_tip thumb_tip");
  put("\\bM\\b", "index_tip");
  put("^add_label L$", "add_label one_more");
  put("\\bL\\b", "index_tip");
  put("\\bMOTOR\\b", "index");
  put("\\+X\\.\\.-Z", "-Y");
  put("\\bMM\\|none\\b", "60");
  put("\\bon\\|off\\|SECONDS\\b", "0.1");
  put("\\bDROP SYNC\\b", "2 2");
  put("\\b(N|MM|F|MS|HZ|COUNTS|CODE|KG|SECONDS|FRACTION)\\b", "1");
  put("\\[?on\\|off\\]?", "on");
  return help.device + " " + words;
}

TEST(Lab, EveryFaultThatItListsIsOneThatItUnderstands) {
  for (const std::string hand : {"", "[hand]\nfile = \"hands/robotiq_2f140.toml\"\ndriver = \"robotiq\"\n"}) {
    const auto lab = make_lab(hand);
    ASSERT_TRUE(lab);
    std::set<std::string> devices;
    for (const FaultHelp& help : lab->fault_help()) {
      devices.insert(help.device);
      const Status known = lab->fault_check()(example(help));
      EXPECT_TRUE(known.ok()) << example(help) << ": " << known.error().detail.view();
      EXPECT_FALSE(help.meaning.empty());
      if (help.words.find("_label") != std::string::npos) continue;  // the following ones would not find their label
      const Status made = lab->fault(example(help));
      EXPECT_TRUE(made.ok()) << example(help) << ": " << made.error().detail.view();
    }
    EXPECT_EQ(devices, (std::set<std::string>{"qtm", "ur", hand.empty() ? "mia" : "robotiq"}));
    EXPECT_GT(lab->fault_help().size(), 60U);
  }
}

TEST(Lab, WhatItDoesNotUnderstandItRefusesInACheckToo) {
  const auto lab = make_lab();
  ASSERT_TRUE(lab);
  for (const std::string command :
       {"", " ", "qtm", "qtm nonsense", "qtm hide nobody", "qtm hide", "ur", "ur nonsense", "ur freeze", "mia",
        "mia nonsense", "mia stall elbow on", "robotiq mute on", "hand mute on", "QTM disconnect", "qtmdisconnect"}) {
    const Status known = lab->fault_check()(command);
    const Status made = lab->fault(command);
    EXPECT_FALSE(known.ok()) << command;
    EXPECT_FALSE(made.ok()) << command;
    if (known.ok() || made.ok()) continue;
    EXPECT_EQ(known.error().detail.view(), made.error().detail.view());
  }
}

TEST(Lab, ACheckFollowsTheNamesThatTheFaultsBeforeHaveLeft) {
  const auto lab = make_lab();
  ASSERT_TRUE(lab);
  const FaultCheck check = lab->fault_check();
  EXPECT_TRUE(check("qtm rename_label index_tip zeigefinger").ok());
  EXPECT_TRUE(check("qtm swap zeigefinger thumb_tip").ok());
  EXPECT_FALSE(check("qtm swap index_tip thumb_tip").ok());
  EXPECT_TRUE(lab->fault("qtm swap index_tip thumb_tip").ok()) << "the lab itself was left alone";
}

TEST(Lab, SaysInOneSentenceWhichDevicesItCannotSimulate) {
  const auto why = [](const std::string& extra) {
    const auto lab = Lab::create(configured(extra), short_recording());
    EXPECT_FALSE(lab.ok());
    return lab ? "" : std::string(lab.error().detail.view());
  };
  EXPECT_NE(why("[tracker]\ndriver = \"landmarks\"\n").find("embody-sim landmarks"), std::string::npos);
  EXPECT_NE(why("[hand]\nfile = \"hands/robotiq_2f140.toml\"\n").find("driver \"mia\" moves"), std::string::npos);

  const auto lab =
      Lab::create(configured("[hand.mia]\nwire = \"can_compact\"\ncan_interface = \"nocan7\"\n"), short_recording());
  ASSERT_TRUE(lab.ok()) << lab.error().detail.view();
  const Status started = (*lab)->start();
  ASSERT_FALSE(started.ok());
  EXPECT_EQ(started.error().detail.view().find("the simulated Mia needs the CAN interface"), 0U)
      << started.error().detail.view();
}

}  // namespace
}  // namespace embody::sim
