// Faults of the marker glove as an operator meets them: the real programs, a simulated tracker with wrong labels.
#include <algorithm>
#include <csignal>

#include "daemon/control/exit_code.hpp"
#include "tests/integration/system/rig.hpp"

namespace embody::test {
namespace {

using control::Command;

/// Looks at the markers until `condition` holds; false after ten seconds.
template <class Condition>
bool until_markers(Rig& rig, Condition&& condition) {
  return rig.until([&](const json&) { return condition(rig.ask(Command::kMarkers)["result"]); });
}

json row(const json& markers, const std::string& label) {
  for (const json& marker : markers["markers"]) {
    if (marker["label"] == label) return marker;
  }
  return json::object();
}

bool says(const json& markers, const std::string& sentence) {
  const json& findings = markers["findings"];
  return std::find(findings.begin(), findings.end(), sentence) != findings.end();
}

Finished embodyctl_markers(const Rig& rig, std::vector<std::string> options) {
  options.insert(options.begin(), "markers");
  options.insert(options.end(), {"--socket", rig.folder.file("control.sock")});
  return run_program("embodyctl", options);
}

TEST(Markers, AreShownWithTheirPlacesWhileAllIsWell) {
  Rig rig;
  rig.lab("play");
  ASSERT_TRUE(until_markers(rig, [](const json& m) { return m["frames"] > 50 && m["back"]["state"] == "good"; }));
  const json markers = rig.ask(Command::kMarkers)["result"];
  ASSERT_EQ(markers["markers"].size(), 13U);
  EXPECT_EQ(row(markers, "index_tip")["finger"], "index");
  EXPECT_GT(row(markers, "index_tip")["seen_percent"], 50.0);
  EXPECT_GT(markers["back"]["edges_mm"]["top_left"], 10.0);
  EXPECT_NEAR(markers["back"]["reference_mm"]["top_left"].get<double>(),
              markers["back"]["edges_mm"]["top_left"].get<double>(), 4.0);
  EXPECT_FALSE(markers["back"]["ambiguous"]) << "the edges of this triangle differ by a centimetre";
  const Finished once = embodyctl_markers(rig, {"--once"});
  EXPECT_EQ(once.exit_code, kExitOk);
  EXPECT_NE(once.output.find("index_tip"), std::string::npos);
  EXPECT_NE(once.output.find("back of the hand   good"), std::string::npos) << once.output;
}

TEST(Markers, AHiddenMarkerIsNamedAndDoesNotStopTheHand) {
  Rig rig;
  ASSERT_TRUE(rig.play_and_engage());
  rig.lab("qtm hide ring_middle");
  ASSERT_TRUE(until_markers(rig, [](const json& m) { return says(m, "ring_middle is not seen"); }));
  EXPECT_EQ(row(rig.ask(Command::kMarkers)["result"], "ring_middle")["verdict"], "missing");
  const json status = rig.status();
  EXPECT_EQ(status["robot_hand"]["action"], "moves") << status.dump(2);
  EXPECT_EQ(status["robot_hand"]["unsure_joints"], json::array());
}

TEST(Markers, AFingerThatIsNotSeenKeepsItsRobotFingerWhereItIsAndSaysSo) {
  Rig rig;
  ASSERT_TRUE(rig.play_and_engage());
  rig.lab("qtm hide index_tip");
  rig.lab("qtm hide index_middle");
  ASSERT_TRUE(rig.until([](const json& s) {
    const json& hand = s["robot_hand"];
    return hand["action"] == "moves" && hand["unsure_joints"] == json::array({"j_index_fle"});
  })) << rig.status().dump(2);
  EXPECT_EQ(rig.mode(), "engaged") << "the arm goes on";
  rig.lab("qtm show index_tip");
  rig.lab("qtm show index_middle");
  EXPECT_TRUE(rig.until([](const json& s) { return s["robot_hand"]["unsure_joints"].empty(); }));
}

TEST(Markers, SwappedLabelsOnTheBackAreNamed) {
  Rig rig;
  rig.lab("play");
  ASSERT_TRUE(until_markers(rig, [](const json& m) { return m["back"]["state"] == "good"; }));
  rig.lab("qtm swap hand_left hand_right");
  EXPECT_TRUE(until_markers(rig, [](const json& m) {
    return says(m, "back markers: hand_left and hand_right are swapped");
  })) << rig.ask(Command::kMarkers)["result"].dump(2);
  const Finished once = embodyctl_markers(rig, {"--once"});
  EXPECT_NE(once.output.find("! back markers: hand_left and hand_right are swapped"), std::string::npos) << once.output;
  rig.lab("qtm swap hand_left hand_right");
  EXPECT_TRUE(until_markers(rig, [](const json& m) { return m["findings"].empty(); }));
}

TEST(Markers, SwappedFingerTipsAreNamedAndPutRight) {
  Rig rig;
  rig.lab("play");
  ASSERT_TRUE(until_markers(rig, [](const json& m) { return m["frames"] > 50; }));
  rig.lab("qtm swap index_tip middle_tip");
  EXPECT_TRUE(until_markers(rig, [](const json& m) {
    return says(m, "index_tip and middle_tip are probably swapped");
  })) << rig.ask(Command::kMarkers)["result"].dump(2);
}

TEST(Markers, AReflectionIsNamedAndNotBelieved) {
  Rig rig;
  rig.lab("play");
  ASSERT_TRUE(until_markers(rig, [](const json& m) { return m["frames"] > 50; }));
  rig.lab("qtm ghost thumb_tip on");
  EXPECT_TRUE(until_markers(rig, [](const json& m) {
    return says(m, "thumb_tip follows something that is not the hand");
  })) << rig.ask(Command::kMarkers)["result"].dump(2);
  EXPECT_NE(row(rig.ask(Command::kMarkers)["result"], "thumb_tip")["verdict"], "used");
  rig.lab("qtm ghost thumb_tip off");
  EXPECT_TRUE(until_markers(rig, [](const json& m) { return row(m, "thumb_tip")["verdict"] == "used"; }));
}

}  // namespace
}  // namespace embody::test
