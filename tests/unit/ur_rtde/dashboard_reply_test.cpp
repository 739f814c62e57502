#include "drivers/ur_rtde/dashboard_reply.hpp"

#include <gtest/gtest.h>

namespace embody::ur {
namespace {

TEST(DashboardReply, NamesBecomeTheCodesOfRtde) {
  EXPECT_EQ(*parse_robot_mode("Robotmode: POWER_OFF"), 3);
  EXPECT_EQ(*parse_robot_mode("Robotmode: RUNNING"), 7);
  EXPECT_EQ(*parse_robot_mode("Robotmode: NO_CONTROLLER"), -1);
  EXPECT_EQ(*parse_safety_status("Safetystatus: PROTECTIVE_STOP"), 3);
  EXPECT_EQ(*parse_safety_status("Safetymode: NORMAL"), 1);
  for (const char* bad : {"", "Robotmode:", "Robotmode: ", "Robotmode: RUNNING ", "Safetystatus: NORMAL"}) {
    EXPECT_EQ(parse_robot_mode(bad).error().code, Errc::kMalformed) << bad;
  }
  EXPECT_FALSE(parse_safety_status("Robotmode: RUNNING"));
}

TEST(DashboardReply, FlagsAndVersions) {
  EXPECT_TRUE(*parse_flag("true"));
  EXPECT_FALSE(*parse_flag("false"));
  EXPECT_TRUE(*parse_flag("Program running: true"));
  EXPECT_FALSE(parse_flag("maybe"));
  EXPECT_EQ(*parse_polyscope_version("URSoftware 5.12.4.1101661 (Sep 21 2022)"), "5.12.4.1101661");
  EXPECT_FALSE(parse_polyscope_version("URSoftware 5.12"));
  EXPECT_FALSE(parse_polyscope_version("could not understand: 'PolyscopeVersion'"));
}

TEST(DashboardReply, AcknowledgementsAndRefusals) {
  EXPECT_TRUE(check_acknowledged("power on", "Powering on", "Powering on"));
  EXPECT_TRUE(check_acknowledged("popup x", "showing popup", "Showing popup")) << "upper and lower case alike";
  const auto code = [](const char* reply) { return check_acknowledged("c", reply, "Expected").error().code; };
  EXPECT_EQ(code("Cannot unlock protective stop until 5s after occurrence. Always inspect"), Errc::kRefused);
  EXPECT_EQ(code("Failed to execute: power on"), Errc::kRefused);
  EXPECT_EQ(code("could not understand: 'c'"), Errc::kUnsupported);
  EXPECT_EQ(code("The command is only allowed in remote control"), Errc::kRefused);
  EXPECT_EQ(code(""), Errc::kMalformed);
}

TEST(DashboardReply, LinesAreTakenWholeHoweverTheyArrive) {
  const std::string stream = "one\r\ntwo\n\nlast";
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    std::string pending = stream.substr(0, cut), line, all;
    const auto drain = [&] {
      while (take_line(pending, line)) all += "[" + line + "]";
    };
    drain();
    pending += stream.substr(cut);
    drain();
    EXPECT_EQ(all, "[one][two][]") << cut;
    EXPECT_EQ(pending, "last");
  }
}

}  // namespace
}  // namespace embody::ur
