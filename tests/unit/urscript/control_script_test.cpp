#include "drivers/ur_rtde/control_script.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "drivers/sim/ur/urscript/compiler.hpp"

namespace embody::rtde {
namespace {

TEST(ControlScript, CompilesUnderItsNameAndIsSmall) {
  const auto text = control_script({});
  ASSERT_TRUE(text.ok());
  EXPECT_EQ(text->back(), '\n');
  EXPECT_EQ(text->find('@'), std::string::npos) << "every word was replaced";
  EXPECT_LT(text->size(), 16'384U);
  const auto code = sim::urscript::compile(*text);
  const auto* const error = std::get_if<sim::urscript::ScriptError>(&code);
  ASSERT_EQ(error, nullptr) << error->line << ": " << error->text.c_str();
  EXPECT_EQ(std::get<sim::urscript::Code>(code).name, kControlScriptName);
}

TEST(ControlScript, ContainsTheConfiguredNumbersExactly) {
  ControlScriptConfig config;
  config.max_velocity_rad_s << 0.1, 1.0, 1.0 / 3.0, 2.5, 0.001, 6.3;
  config.gain = 1200.0;
  config.lookahead_s = 0.03;
  const auto text = control_script(config);
  ASSERT_TRUE(text.ok());
  EXPECT_NE(text->find("VMAX = [0.1, 1.0, 0.3333333333333333, 2.5, 0.001, 6.3]"), std::string::npos);
  EXPECT_NE(text->find("servoj(cmd, t=dt, lookahead_time=0.03, gain=1200.0)"), std::string::npos);
}

TEST(ControlScript, RefusesImpossibleLimitsByName) {
  using Change = std::function<void(ControlScriptConfig&, double)>;
  const std::vector<std::pair<const char*, Change>> changes{
      {"velocity", [](auto& c, double x) { c.max_velocity_rad_s[3] = x; }},
      {"acceleration", [](auto& c, double x) { c.max_acceleration_rad_s2[0] = x; }},
      {"smallest joint angle", [](auto& c, double x) { c.min_angle_rad[5] = x; }},
      {"largest joint angle", [](auto& c, double x) { c.max_angle_rad[1] = x; }},
      {"approach gain", [](auto& c, double x) { c.approach_gain_1_s = x; }},
      {"arming tolerance", [](auto& c, double x) { c.arm_tolerance_rad = x; }},
      {"look-ahead", [](auto& c, double x) { c.lookahead_s = x; }},
      {"servoj gain", [](auto& c, double x) { c.gain = x; }},
      {"deceleration", [](auto& c, double x) { c.stop_deceleration_rad_s2 = x; }},
      {"watchdog", [](auto& c, double x) { c.watchdog_hz = x; }}};
  for (const auto& [name, change] : changes) {
    for (const double value : {-1e9, 1e9, std::nan(""), std::numeric_limits<double>::infinity()}) {
      ControlScriptConfig config;
      change(config, value);
      const auto text = control_script(config);
      ASSERT_FALSE(text.ok()) << name << " " << value;
      EXPECT_NE(text.error().detail.view().find(name), std::string_view::npos) << text.error().detail.c_str();
    }
  }
}

TEST(ControlScript, RefusesAnEmptyRangeAndAWatchdogFasterThanTheStaleTime) {
  ControlScriptConfig config;
  config.min_angle_rad[2] = 1.0;
  config.max_angle_rad[2] = 1.0;
  EXPECT_FALSE(control_script(config).ok());
  config = {};
  config.watchdog_hz = 25.0;  // 40 ms
  EXPECT_FALSE(control_script(config).ok());
  config = {};
  config.stale_after = std::chrono::milliseconds(5);
  EXPECT_FALSE(control_script(config).ok());
}

}  // namespace
}  // namespace embody::rtde
