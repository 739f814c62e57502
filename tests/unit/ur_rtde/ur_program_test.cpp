// The driver's upkeep: how the control program gets onto the robot, and what keeps it from there.
#include <gtest/gtest.h>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/ur_rtde/program_upload.hpp"
#include "tests/unit/ur_rtde/ur_lab.hpp"

namespace embody {
namespace {

using test::ServicedLoop;
using test::UrLab;

sim::UrControllerConfig without_program() {
  sim::UrControllerConfig config = test::fast_controller();
  config.robot.program_text = "";
  return config;
}

/// Plays for ever and knows nothing of our registers.
constexpr const char* kForeignProgram = "def foreign():\n  while True:\n    sync()\n  end\nend\n";

TEST(UrProgram, IsUploadedWhenNothingPlaysAndMovesNothing) {
  UrLab lab(without_program());
  ServicedLoop serviced(lab.driver());
  ASSERT_TRUE(serviced.loop.next());
  EXPECT_EQ(serviced.loop.state.condition, ArmCondition::kProgramStopped);
  ASSERT_TRUE(serviced.ready()) << serviced.sentence();
  EXPECT_EQ(serviced.sentence(), "");
  EXPECT_FALSE(serviced.loop.state.tracking);
  EXPECT_EQ(serviced.loop.arm->snapshot().controller.time_scale_source, 1) << "full speed";
  EXPECT_EQ(serviced.loop.state.q_rad, sim::UrRobotConfig{}.q_start_rad);
  EXPECT_TRUE(serviced.loop.engage());
  const UrCounters& counters = serviced.loop.arm->counters();
  EXPECT_EQ(counters.uploads, 1U);
  EXPECT_EQ(counters.upload_failures, 0U);
  EXPECT_GT(counters.packages, 10U);
  EXPECT_GT(counters.commands, 10U);
  EXPECT_EQ(counters.refused, 0U);
}

TEST(UrProgram, IsNotStartedBeforeCommandsFlow) {
  UrLab lab(without_program());
  test::ArmLoop loop(lab.driver());
  ASSERT_TRUE(loop.next());
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(loop.arm->service().ok());
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(loop.next());
  EXPECT_EQ(loop.state.condition, ArmCondition::kProgramStopped);
}

TEST(UrProgram, OfSomebodyElseIsNeverReplaced) {
  sim::UrControllerConfig config = without_program();
  config.robot.program_text = kForeignProgram;
  UrLab lab(config);
  ServicedLoop serviced(lab.driver());
  EXPECT_TRUE(serviced.says({"another program", "stop it"})) << serviced.sentence();
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(serviced.loop.next());
  EXPECT_EQ(lab.controller.safety().runtime_state, 2U);
  EXPECT_EQ(serviced.loop.state.condition, ArmCondition::kProgramStopped);
  lab.fault("program off");
  EXPECT_TRUE(serviced.ready()) << serviced.sentence();
}

TEST(UrProgram, LocalControlIsExplainedAndTheSwitchToRemoteIsNoticed) {
  sim::UrControllerConfig config = without_program();
  config.remote = false;
  UrLab lab(config);
  ServicedLoop serviced(lab.driver());
  EXPECT_TRUE(serviced.says({"local control", "C210", "Remote Control"})) << serviced.sentence();
  lab.fault("remote");
  EXPECT_TRUE(serviced.ready()) << serviced.sentence();
}

TEST(UrProgram, RefusedUploadIsTriedAgainLater) {
  UrLab lab(without_program());
  lab.fault("refuse-upload on");
  ServicedLoop serviced(lab.driver());
  EXPECT_TRUE(serviced.says({"C210"})) << serviced.sentence();
  lab.fault("refuse-upload off");
  EXPECT_TRUE(serviced.ready()) << serviced.sentence();
}

TEST(UrProgram, AScriptThatTheRobotRejectsIsQuotedAndSentOnce) {
  UrLab lab(without_program());
  ur::ProgramUpload upload({.host = "127.0.0.1",
                            .port = lab.controller.primary_port(),
                            .program = "def wrong():\n  a = 1\n  b = no_such_function(a)\nend\n",
                            .retry_after = Duration(0)});
  ur::SharedArmStatus status;
  const rtde::ControllerStatus idle{7, 1, 1, 1, 0, 0};
  Status result;
  int complaints = 0;
  for (const TimePoint end = transport::now() + std::chrono::seconds(5); complaints < 5 && transport::now() < end;) {
    status.publish(1, idle, true);
    status.count_command();
    result = upload.service(status);
    if (!result) ++complaints;
    ASSERT_TRUE(complaints == 0 || !result) << "once rejected, always rejected";
    if (result) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  ASSERT_EQ(complaints, 5);
  const std::string detail = result.error().detail.c_str();
  EXPECT_EQ(result.error().code, Errc::kMalformed);
  EXPECT_NE(detail.find("line 3"), std::string::npos) << detail;
  EXPECT_NE(detail.find("b = no_such_function(a)"), std::string::npos) << detail;
  EXPECT_EQ(upload.uploads(), 1U);
  EXPECT_EQ(upload.failures(), 1U);
}

/// Other devices are connected by the same thread: nothing here waits for a robot that takes its time.
TEST(UrProgram, UpkeepDoesNotWaitForTheProgramToStart) {
  const auto listener = transport::tcp_listen("127.0.0.1", 0);
  ASSERT_TRUE(listener) << listener.error().detail.c_str();
  ur::ProgramUpload upload({.host = "127.0.0.1",
                            .port = transport::local_port(listener->get()),
                            .program = std::string(20'000, ' ') + "\n",
                            .confirm_timeout = std::chrono::seconds(2),
                            .retry_after = std::chrono::seconds(60)});
  ur::SharedArmStatus status;
  const rtde::ControllerStatus idle{7, 1, 1, 1, 0, 0};
  Status result;
  Duration longest{0};
  for (const TimePoint end = transport::now() + std::chrono::seconds(10); result && transport::now() < end;) {
    status.publish(1, idle, true);
    status.count_command();
    const TimePoint begin = transport::now();
    result = upload.service(status);
    longest = std::max(longest, transport::now() - begin);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  std::printf("longest round of upkeep %.1f ms\n", 1e3 * to_seconds(longest));
  ASSERT_FALSE(result);
  EXPECT_NE(std::string(result.error().detail.c_str()).find("does not start"), std::string::npos);
  EXPECT_EQ(upload.uploads(), 1U);
  EXPECT_LT(longest, std::chrono::milliseconds(500)) << "it waited for the program";
}

TEST(UrProgram, ThatStopsIsLoadedAnewAndTheArmWaitsForANewSeries) {
  UrLab lab;
  ServicedLoop serviced(lab.driver());
  ASSERT_TRUE(serviced.ready());
  ASSERT_TRUE(serviced.loop.engage());
  lab.fault("program off");
  const auto gone = [](const ArmState& s) { return s.condition == ArmCondition::kProgramStopped; };
  ASSERT_TRUE(serviced.loop.send_until(ArmAction::kTrack, serviced.loop.state.q_rad, gone));
  ASSERT_TRUE(serviced.ready()) << serviced.sentence();
  EXPECT_FALSE(serviced.loop.state.tracking);
  EXPECT_TRUE(serviced.loop.engage());
}

TEST(UrProgram, ThatDoesNotAnswerCountsAsStoppedAndIsLeftAlone) {
  UrLab lab;
  ServicedLoop serviced(lab.driver());
  ASSERT_TRUE(serviced.ready());
  ASSERT_TRUE(serviced.loop.engage());
  lab.fault("echo on");
  const TimePoint begin = transport::now();
  const auto stopped = [](const ArmState& s) { return s.condition == ArmCondition::kProgramStopped && !s.tracking; };
  ASSERT_TRUE(serviced.loop.send_until(ArmAction::kTrack, serviced.loop.state.q_rad, stopped));
  std::printf("frozen echo noticed after %.0f ms\n", 1e3 * to_seconds(transport::now() - begin));
  EXPECT_LT(transport::now() - begin, std::chrono::seconds(1));
  EXPECT_TRUE(serviced.says({"does not answer"})) << serviced.sentence();
  EXPECT_EQ(serviced.loop.arm->counters().silences, 1U);
  lab.fault("echo off");
  EXPECT_TRUE(serviced.ready()) << serviced.sentence();
}

TEST(UrProgram, SurvivesAReconnectWithoutBeingLoadedAgain) {
  UrLab lab;
  ServicedLoop serviced(lab.driver());
  ASSERT_TRUE(serviced.ready());
  ASSERT_TRUE(serviced.loop.engage());
  const Vector6 before = serviced.loop.state.q_rad;
  ASSERT_TRUE(serviced.loop.connect());
  ASSERT_TRUE(serviced.loop.next());
  ASSERT_TRUE(serviced.ready()) << serviced.sentence();
  EXPECT_FALSE(serviced.loop.state.tracking);
  EXPECT_LT((serviced.loop.state.q_rad - before).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(UrProgram, NobodyAtTheProgramPortIsASentenceOnlyWhenItIsNeeded) {
  UrLab lab;
  UrRtdeConfig config = lab.driver();
  config.primary_port = 1;
  ServicedLoop serviced(config);
  EXPECT_TRUE(serviced.ready());
  EXPECT_EQ(serviced.sentence(), "") << "our program plays already";
  lab.fault("program off");
  EXPECT_TRUE(serviced.says({"cannot be loaded"})) << serviced.sentence();
}

TEST(UrInstallation, AWrongPayloadToolOrModelIsASentence) {
  sim::UrControllerConfig config = test::fast_controller();
  config.settings.payload_kg = 1.0;
  config.settings.cog_m = {0.0, 0.0, 0.05};
  config.settings.tcp = {0.0, 0.0, 0.12, 0.0, 0.0, 0.3};
  UrLab lab(config);
  UrRtdeConfig driver = lab.driver();
  driver.expected = {"UR10e", 1.0, config.settings.cog_m, config.settings.tcp};
  {
    ServicedLoop serviced(driver);
    ASSERT_TRUE(serviced.ready());
    ASSERT_TRUE(serviced.hold_until([&](auto&, auto&) { return serviced.loop.state.package > 200; }));
    EXPECT_EQ(serviced.sentence(), "");
    EXPECT_TRUE(serviced.loop.arm->kinematics().has_value());
    lab.fault("payload 2.5");
    EXPECT_TRUE(serviced.says({"payload", "2.50 kg", "1.00 kg"})) << serviced.sentence();
    lab.fault("payload 1");
  }
  driver.expected.tcp->at(2) = 0.2;
  EXPECT_TRUE(ServicedLoop(driver).says({"tool centre point"}));
  driver.expected.tcp.reset();
  driver.expected.cog_m->at(0) = 0.1;
  EXPECT_TRUE(ServicedLoop(driver).says({"centre of gravity"}));
  driver.expected.model = "UR5e";
  EXPECT_TRUE(ServicedLoop(driver).says({"ur5e", "ur10e", "arm model"}));
}

TEST(UrInstallation, FirmwareWithoutTheSettingsIsNotCompared) {
  sim::UrControllerConfig config = test::fast_controller();
  config.missing = {"payload", "payload_cog", "time_scale_source"};
  UrLab lab(config);
  UrRtdeConfig driver = lab.driver();
  driver.expected.payload_kg = 3.0;
  ServicedLoop serviced(driver);
  EXPECT_TRUE(serviced.ready());
  EXPECT_EQ(serviced.sentence(), "");
  EXPECT_TRUE(serviced.loop.engage());
}

}  // namespace
}  // namespace embody
