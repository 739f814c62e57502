// Power, brakes and stops: the operator's requests over the dashboard, and what the driver makes of the modes.
#include <gtest/gtest.h>

#include "tests/unit/ur_rtde/ur_lab.hpp"

namespace embody {
namespace {

using test::ServicedLoop;
using test::UrLab;

ur::BringUpConfig patient() {
  ur::BringUpConfig config;
  config.poll_period = std::chrono::milliseconds(10);
  return config;
}

const auto kNever = [] { return false; };

TEST(UrBringUp, PowersReleasesTheBrakesAndLoadsTheProgram) {
  sim::UrControllerConfig config = test::fast_controller();
  config.powered = false;
  config.robot.program_text = "";
  UrLab lab(config);
  ServicedLoop serviced(lab.driver());
  EXPECT_TRUE(serviced.says({"not running", "power off", "brakes"})) << serviced.sentence();
  EXPECT_EQ(serviced.loop.state.condition, ArmCondition::kNotRunning);
  ur::Dashboard dashboard = lab.dashboard();
  const Status up = dashboard.bring_up(patient(), kNever);
  ASSERT_TRUE(up.ok()) << up.error().detail.c_str();
  EXPECT_EQ(*dashboard.robot_mode(), 7);
  EXPECT_TRUE(dashboard.bring_up(patient(), kNever).ok()) << "nothing to do";
  EXPECT_TRUE(serviced.ready()) << serviced.sentence();
}

TEST(UrBringUp, CanBeCancelledAndHasDeadlines) {
  sim::UrControllerConfig config = test::fast_controller();
  config.powered = false;
  config.times.boot = std::chrono::hours(1);
  UrLab lab(config);
  ur::Dashboard dashboard = lab.dashboard();
  EXPECT_EQ(dashboard.bring_up(patient(), [] { return true; }).error().code, Errc::kRefused);
  ur::BringUpConfig hasty = patient();
  hasty.power_timeout = std::chrono::milliseconds(50);
  const Status late = dashboard.bring_up(hasty, kNever);
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().code, Errc::kTimeout);
  EXPECT_NE(late.error().detail.view().find("booting"), std::string_view::npos) << late.error().detail.c_str();
}

TEST(UrBringUp, ReleasesNoStop) {
  UrLab lab;
  lab.fault("protective-stop");
  ur::Dashboard dashboard = lab.dashboard();
  const TimePoint deadline = transport::now() + test::kPatience;
  while (*dashboard.safety_status() != 3 && transport::now() < deadline) {
  }
  const Status refused = dashboard.bring_up(patient(), kNever);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().detail.view().find("protective stop"), std::string_view::npos);
}

TEST(UrStops, AProtectiveStopIsReleasedByTheOperatorOnlyAndNothingResumes) {
  UrLab lab;
  ServicedLoop serviced(lab.driver());
  ASSERT_TRUE(serviced.ready());
  ASSERT_TRUE(serviced.loop.engage());
  lab.fault("protective-stop");
  EXPECT_TRUE(serviced.says({"protective stop", "look for its cause"})) << serviced.sentence();
  EXPECT_EQ(serviced.loop.state.condition, ArmCondition::kProtectiveStop);
  const Vector6 rest = serviced.loop.state.q_rad;

  ur::Dashboard dashboard = lab.dashboard();
  TimePoint deadline = transport::now() + test::kPatience;
  Status unlocked = dashboard.unlock_protective_stop();
  while (!unlocked && transport::now() < deadline) {  // 5 s, here 0.2 s
    EXPECT_NE(unlocked.error().detail.view().find("5 s"), std::string_view::npos) << unlocked.error().detail.c_str();
    ASSERT_TRUE(serviced.loop.next());
    serviced.loop.send(ArmAction::kHold);
    unlocked = dashboard.unlock_protective_stop();
  }
  ASSERT_TRUE(unlocked.ok());
  EXPECT_TRUE(serviced.says({"paused", "stop it"})) << serviced.sentence();
  EXPECT_EQ(lab.controller.safety().runtime_state, 4U) << "the program stays paused";
  ASSERT_TRUE(dashboard.stop_program().ok());
  ASSERT_TRUE(serviced.ready()) << serviced.sentence();
  EXPECT_FALSE(serviced.loop.state.tracking);
  EXPECT_LT((serviced.loop.state.q_rad - rest).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_TRUE(serviced.loop.engage());
}

TEST(UrStops, AnEmergencyStopTakesThePowerAndTheProgram) {
  UrLab lab;
  ServicedLoop serviced(lab.driver());
  ASSERT_TRUE(serviced.ready());
  lab.fault("emergency-stop");
  EXPECT_TRUE(serviced.says({"emergency stop", "unlock"})) << serviced.sentence();
  EXPECT_EQ(serviced.loop.state.condition, ArmCondition::kEmergencyStop);
  lab.fault("release-emergency-stop");
  EXPECT_TRUE(serviced.says({"not running", "power off"})) << serviced.sentence();
  ASSERT_TRUE(lab.dashboard().bring_up(patient(), kNever).ok());
  EXPECT_TRUE(serviced.ready()) << serviced.sentence();
  EXPECT_FALSE(serviced.loop.state.tracking);
}

TEST(UrStops, ASafeguardThatClosesResumesTheProgramButNotTheMotion) {
  UrLab lab;
  ServicedLoop serviced(lab.driver());
  ASSERT_TRUE(serviced.ready());
  ASSERT_TRUE(serviced.loop.engage());
  lab.fault("safeguard on");
  EXPECT_TRUE(serviced.says({"safeguard"})) << serviced.sentence();
  lab.fault("safeguard off");
  ASSERT_TRUE(serviced.ready()) << serviced.sentence();
  EXPECT_TRUE(serviced.hold_until([](const ArmState& s, auto&) { return !s.tracking; }));
  EXPECT_TRUE(serviced.loop.engage());
}

TEST(UrDashboard, AnswersQuestionsAndRefusesRequestsInLocalControl) {
  UrLab lab;
  ur::Dashboard dashboard = lab.dashboard();
  EXPECT_EQ(*dashboard.polyscope_version(), "5.12.4.1101661");
  EXPECT_EQ(*dashboard.robot_model(), "UR10");
  EXPECT_FALSE(dashboard.serial_number()->empty());
  EXPECT_TRUE(*dashboard.in_remote_control());
  EXPECT_EQ(*dashboard.safety_status(), 1);
  EXPECT_TRUE(dashboard.popup("one\nquit").ok()) << "a line end must not become a second command";
  EXPECT_TRUE(dashboard.close_popup().ok());
  EXPECT_TRUE(dashboard.close_safety_popup().ok());
  EXPECT_EQ(*dashboard.ask("nonsense"), "could not understand: 'nonsense'");
  lab.fault("local");
  const TimePoint deadline = transport::now() + test::kPatience;
  while (*dashboard.in_remote_control() && transport::now() < deadline) {
  }
  const Status refused = dashboard.power_off();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::kRefused);
  EXPECT_NE(refused.error().detail.view().find("Remote Control"), std::string_view::npos);
  EXPECT_EQ(*dashboard.ask("quit"), "Disconnected");
  EXPECT_EQ(*dashboard.robot_mode(), 7) << "connects again by itself";
}

TEST(UrDashboard, IsAbsentOnPolyScopeXAndMayBeUnreachable) {
  ur::DashboardConfig config;
  config.controller_major = 10;
  EXPECT_EQ(ur::Dashboard(config).power_on().error().code, Errc::kUnsupported);
  config.controller_major = 5;
  config.port = 1;
  EXPECT_EQ(ur::Dashboard(config).power_on().error().code, Errc::kDisconnected);
  sim::UrControllerConfig x = test::fast_controller();
  x.version = {10, 12, 0, 0};
  const UrLab lab(x);
  EXPECT_EQ(lab.controller.dashboard_port(), 0);
}

}  // namespace
}  // namespace embody
