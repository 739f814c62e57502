// The daemon as an operator meets it.
#include <cmath>
#include <csignal>

#include "daemon/control/exit_code.hpp"
#include "tests/integration/system/rig.hpp"

namespace embody::test {
namespace {

using control::Command;

bool still(Rig& rig) {
  return rig.report()["arm_now"]["speed_rad_s"].get<double>() < 1e-3;
}

/// Waits until the arm's plant stands still.
bool comes_to_rest(Rig& rig) {
  for (int i = 0; i < 200; ++i) {
    if (still(rig)) return true;
  }
  return false;
}

/// Largest joint difference; the plant creeps by some 1e-5 rad while it settles.
double difference_rad(const json& a, const json& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < 6; ++i) largest = std::max(largest, std::abs(a[i].get<double>() - b[i].get<double>()));
  return largest;
}

/// Every robot package was answered by one command; those that the driver refused because this machine stalled for more
/// than a command's lifetime are counted by the daemon and stay few. Counters move on while we look, so look again.
void expect_one_command_per_package(Rig& rig) {
  EXPECT_TRUE(rig.until([](const json& s) {
    const json& c = s["counters"];
    return c["arm_commands"].get<int>() + c["arm_commands_dropped"].get<int>() == c["robot_packages"].get<int>();
  })) << rig.status()["counters"].dump(2);
  const json counters = rig.status()["counters"];
  EXPECT_LT(counters["arm_commands_dropped"].get<int>(), counters["robot_packages"].get<int>() / 20);
  if (counters["arm_commands_dropped"] > 0)
    GTEST_LOG_(INFO) << "this machine stalled: " << counters["arm_commands_dropped"];
  EXPECT_EQ(rig.report()["ur"]["sequence_gaps"], 0);
}

bool hand_was_stopped(Rig& rig) {
  return rig.until([&](const json&) { return rig.report()["mia"]["stops"] > 0; }, 2);
}

TEST(System, ArmAndHandFollowTheRecordingAndEveryFrameIsUsedOnce) {
  Rig rig({.duration_s = 8.0});
  ASSERT_TRUE(rig.play_and_engage());
  rig.wait_event("playback_finished");
  EXPECT_TRUE(rig.ask(Command::kDisengage)["ok"]);
  const json counters = rig.status()["counters"];
  EXPECT_EQ(counters["frames_received"], 800);
  EXPECT_EQ(counters["frames_used"], 800);
  EXPECT_EQ(counters["finger_frames"].get<int>() + counters["finger_skipped"].get<int>(), 800);
  EXPECT_EQ(counters["rt_heap_allocations"], 0);
  expect_one_command_per_package(rig);
  const json report = rig.report();
  if (counters["holds"] == 0) {
    EXPECT_TRUE(report["followed"]) << report.dump(2);
  } else {
    GTEST_LOG_(INFO) << "this machine stalled: " << counters["holds"] << " holds";
  }
}

class SlowFingers : public ::testing::TestWithParam<const char*> {};

TEST_P(SlowFingers, DoNotCostTheArmASingleCommand) {
  Rig rig({.duration_s = 5.0,
           .extra_config = std::string("[record_mapping]\nslow_down_ms = 50\nslow_down_spins = ") + GetParam() + "\n"});
  ASSERT_TRUE(rig.play_and_engage());
  rig.wait_event("playback_finished");
  rig.ask(Command::kDisengage);
  const json counters = rig.status()["counters"];
  EXPECT_GT(counters["robot_packages"], 1000);
  EXPECT_EQ(counters["frames_used"], 500);
  EXPECT_GT(counters["finger_frames"], 0);
  EXPECT_GT(counters["finger_skipped"], 200) << "the finger stage was not slow";
  expect_one_command_per_package(rig);
}

INSTANTIATE_TEST_SUITE_P(SleepingAndComputing, SlowFingers, ::testing::Values("false", "true"));

TEST(System, NothingMovesBeforeTheOperatorEngages) {
  Rig rig;
  const json before = rig.report()["arm_now"]["q_rad"];
  ASSERT_TRUE(rig.until([](const json& s) { return s["mode"]["name"] == "idle"; }));
  EXPECT_FALSE(rig.ask(Command::kEngage)["ok"]) << "no frame has come yet";
  rig.lab("play");
  ASSERT_TRUE(rig.until_mode("aligned"));
  const json report = rig.report();
  EXPECT_EQ(report["arm_now"]["q_rad"], before);
  EXPECT_EQ(report["mia"]["motions"], 0);
}

TEST(System, ASilentTrackerEndsInHoldAndOnlyTheOperatorGoesOn) {
  Rig rig;
  ASSERT_TRUE(rig.play_and_engage());
  rig.lab("qtm pause 500");
  ASSERT_TRUE(rig.until_mode("holding"));
  EXPECT_TRUE(comes_to_rest(rig));
  EXPECT_EQ(rig.status()["counters"]["holds"], 1);
  // Frames come again, but the arm stays where it is.
  const std::uint64_t frames = rig.status()["counters"]["frames_used"];
  ASSERT_TRUE(rig.until([&](const json& s) { return s["counters"]["frames_used"] > frames + 20; }));
  EXPECT_EQ(rig.mode(), "holding");
  EXPECT_TRUE(still(rig));
  ASSERT_TRUE(rig.engage());
  EXPECT_EQ(rig.mode(), "engaged");
}

TEST(System, ALostTrackerStopsAndNeedsAReset) {
  Rig rig;
  ASSERT_TRUE(rig.play_and_engage());
  rig.lab("qtm pause 60000");
  ASSERT_TRUE(rig.until_mode("stopped"));
  EXPECT_EQ(rig.status()["mode"]["cause"], "hand tracker not connected");
  EXPECT_FALSE(rig.ask(Command::kEngage)["ok"]);
  EXPECT_TRUE(comes_to_rest(rig));
}

TEST(System, TheTrackerMayDisconnectAndComeBack) {
  Rig rig;
  ASSERT_TRUE(rig.play_and_engage());
  rig.lab("qtm disconnect");
  ASSERT_TRUE(rig.until([](const json& s) {
    const std::string mode = s["mode"]["name"];
    return mode == "holding" || mode == "stopped";
  }));
  EXPECT_TRUE(comes_to_rest(rig));
  ASSERT_TRUE(rig.until([](const json& s) { return s["devices"]["tracker"]["sessions"] == 2; }));
  ASSERT_TRUE(rig.ask(Command::kReset)["ok"]);
  ASSERT_TRUE(rig.engage());
}

TEST(System, ALostArmStopsAndReconnectingMovesNothing) {
  Rig rig;
  ASSERT_TRUE(rig.play_and_engage());
  rig.lab("ur disconnect");
  ASSERT_TRUE(rig.until_mode("stopped"));
  EXPECT_EQ(rig.status()["mode"]["cause"], "robot arm not connected");
  ASSERT_TRUE(rig.until([](const json& s) {
    return s["devices"]["arm"]["sessions"] == 2 && s["devices"]["arm"]["state"] == "connected";
  }));
  ASSERT_TRUE(comes_to_rest(rig));
  const json q = rig.report()["arm_now"]["q_rad"];
  EXPECT_FALSE(rig.ask(Command::kEngage)["ok"]) << "stopped needs a reset first";
  ASSERT_TRUE(rig.until([&](const json&) { return rig.ask(Command::kReset)["ok"].get<bool>(); }));
  EXPECT_LT(difference_rad(rig.report()["arm_now"]["q_rad"], q), 1e-3);
  ASSERT_TRUE(rig.engage());
}

TEST(System, AFrozenArmIsNoticed) {
  Rig rig;
  ASSERT_TRUE(rig.play_and_engage());
  rig.lab("ur freeze on");
  ASSERT_TRUE(rig.until_mode("stopped", 2));
  rig.lab("ur freeze off");
}

TEST(System, AnUnpluggedHandStopsTheArmToo) {
  Rig rig;
  ASSERT_TRUE(rig.play_and_engage());
  rig.lab("mia unplug");
  ASSERT_TRUE(rig.until_mode("stopped"));
  EXPECT_EQ(rig.status()["mode"]["cause"], "robot hand not connected");
  EXPECT_TRUE(comes_to_rest(rig));
  rig.lab("mia plug");
  ASSERT_TRUE(rig.until([](const json& s) { return s["devices"]["hand"]["sessions"] == 2; }));
  ASSERT_TRUE(rig.until([&](const json&) { return rig.ask(Command::kReset)["ok"].get<bool>(); }));
  ASSERT_TRUE(rig.engage());
}

TEST(System, AProtectiveStopIsLeftOnlyByClearingResetAndEngage) {
  Rig rig;
  ASSERT_TRUE(rig.play_and_engage());
  rig.lab("ur protective_stop");
  ASSERT_TRUE(rig.until_mode("stopped"));
  EXPECT_EQ(rig.status()["mode"]["cause"], "protective stop of the robot");
  EXPECT_FALSE(rig.ask(Command::kReset)["ok"]) << "the robot is still in protective stop";
  rig.lab("ur clear_stop");
  ASSERT_TRUE(rig.until([&](const json&) { return rig.ask(Command::kReset)["ok"].get<bool>(); }));
  EXPECT_NE(rig.mode(), "engaged");
  EXPECT_TRUE(comes_to_rest(rig));
  ASSERT_TRUE(rig.engage());
}

TEST(System, StopAndDisengageBringTheArmToRest) {
  Rig rig;
  ASSERT_TRUE(rig.play_and_engage());
  EXPECT_TRUE(rig.ask(Command::kDisengage)["ok"]);
  EXPECT_TRUE(comes_to_rest(rig));
  EXPECT_FALSE(rig.report()["arm_now"]["tracking"]);
  ASSERT_TRUE(rig.engage());
  EXPECT_TRUE(rig.ask(Command::kStop)["ok"]);
  EXPECT_EQ(rig.mode(), "stopped");
  EXPECT_TRUE(comes_to_rest(rig));
  EXPECT_TRUE(hand_was_stopped(rig));
}

TEST(System, TheHandSkipsToHoldWhenMarkersOfTheBackVanish) {
  Rig rig;
  ASSERT_TRUE(rig.play_and_engage());
  rig.lab("qtm hide hand_top");
  ASSERT_TRUE(rig.until_mode("holding"));
  EXPECT_TRUE(comes_to_rest(rig));
}

TEST(System, SigtermAndCtrlCStopArmAndHandCleanly) {
  for (const int signal : {SIGTERM, SIGINT}) {
    Rig rig;
    ASSERT_TRUE(rig.play_and_engage());
    EXPECT_EQ(rig.stop_daemon(signal), signal == SIGINT ? kExitInterrupted : kExitOk);
    EXPECT_TRUE(comes_to_rest(rig));
    const json report = rig.report();
    EXPECT_FALSE(report["arm_now"]["tracking"]);
    EXPECT_GE(report["mia"]["stops"].get<int>(), 1);
    EXPECT_NE(rig.daemon_log().find("the arm stands still"), std::string::npos);
  }
}

TEST(System, WhenTheDaemonIsKilledTheArmBrakesByItself) {
  Rig rig;
  ASSERT_TRUE(rig.play_and_engage());
  rig.stop_daemon(SIGKILL);
  EXPECT_TRUE(comes_to_rest(rig));
  EXPECT_FALSE(rig.report()["arm_now"]["tracking"]);
}

TEST(System, AStoppedProcessIsHeldByTheRobot) {
  Rig rig;
  ASSERT_TRUE(rig.play_and_engage());
  rig.daemon().signal(SIGSTOP);
  EXPECT_TRUE(comes_to_rest(rig));
  EXPECT_FALSE(rig.report()["arm_now"]["tracking"]);
  rig.daemon().signal(SIGCONT);
  EXPECT_TRUE(rig.until([](const json& s) {
    const std::string mode = s["mode"]["name"];
    return mode == "holding" || mode == "stopped";
  })) << "it must not go on by itself";
  EXPECT_TRUE(comes_to_rest(rig));
}

TEST(System, ASecondDaemonOnTheSameSocketIsRefused) {
  Rig rig;
  const Finished second = run_program("embodyd", {"--config", rig.folder.file("embody.toml")});
  EXPECT_NE(second.exit_code, 0);
  EXPECT_NE(second.errors.find("control.sock"), std::string::npos) << second.errors;
}

TEST(System, ShutdownEndsTheDaemonWithoutError) {
  Rig rig;
  EXPECT_TRUE(rig.ask(Command::kShutdown)["ok"]);
  for (int i = 0; i < 1000 && !rig.daemon().exit_code(); ++i) ::usleep(10'000);
  ASSERT_TRUE(rig.daemon().exit_code().has_value());
  EXPECT_EQ(*rig.daemon().exit_code(), 0);
}

}  // namespace
}  // namespace embody::test
