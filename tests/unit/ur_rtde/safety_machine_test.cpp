#include "drivers/sim/ur/safety_machine.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace embody::sim {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(SafetyMachine, PowersUpStepByStep) {
  SafetyMachine machine;
  machine.power_off();
  EXPECT_EQ(machine.status().robot_mode, 3);
  EXPECT_EQ(machine.status().robot_status_bits, 0U);
  machine.set_program_running(true);
  EXPECT_FALSE(machine.playing()) << "no program without power";
  EXPECT_FALSE(machine.release_brakes());
  ASSERT_TRUE(machine.power_on());
  std::string modes;
  for (int i = 0; i < 60; ++i) {
    modes += std::to_string(machine.status().robot_mode);
    if (machine.status().robot_mode == 5) (void)machine.release_brakes();
    machine.advance(milliseconds(100));
  }
  modes.erase(std::unique(modes.begin(), modes.end()), modes.end());
  EXPECT_EQ(modes, "2457");
  EXPECT_TRUE(machine.may_move());
  EXPECT_EQ(machine.status().runtime_state, 1U) << "nothing plays by itself";
}

TEST(SafetyMachine, AProtectiveStopHoldsForFiveSecondsAndKeepsTheProgramPaused) {
  SafetyMachine machine;
  machine.protective_stop();
  EXPECT_EQ(machine.status().runtime_state, 4U);
  EXPECT_EQ(machine.status().safety_status_bits, 0b100'0000'0100U);
  machine.advance(seconds(5) - milliseconds(1));
  machine.protective_stop();  // does not start the time anew
  EXPECT_FALSE(machine.unlock_protective_stop());
  machine.advance(milliseconds(1));
  EXPECT_TRUE(machine.unlock_protective_stop());
  EXPECT_EQ(machine.status().safety_status_bits, 1U);
  EXPECT_EQ(machine.status().runtime_state, 4U);
  EXPECT_FALSE(machine.unlock_protective_stop()) << "there is none any more";
}

TEST(SafetyMachine, AnEmergencyStopTakesPowerAndProgramAndIsReleasedWithoutThem) {
  SafetyMachine machine;
  machine.protective_stop();
  machine.emergency_stop();
  machine.protective_stop();
  EXPECT_EQ(machine.status().safety_status, 7);
  EXPECT_EQ(machine.status().robot_mode, 3);
  EXPECT_EQ(machine.status().runtime_state, 1U);
  EXPECT_FALSE(machine.power_on());
  EXPECT_FALSE(machine.unlock_protective_stop());
  machine.release_emergency_stop();
  EXPECT_FALSE(machine.stopped());
  EXPECT_EQ(machine.status().robot_mode, 3);
}

TEST(SafetyMachine, ASafeguardResumesOnlyWhatItPaused) {
  for (const bool resumes : {true, false}) {
    SafetyMachine machine;
    SafetyTimes times;
    times.safeguard_resumes = resumes;
    machine.set_times(times);
    machine.safeguard_stop(true);
    EXPECT_EQ(machine.status().safety_status, 5);
    EXPECT_FALSE(machine.playing());
    machine.safeguard_stop(false);
    EXPECT_EQ(machine.playing(), resumes);
  }
  SafetyMachine idle;
  idle.set_program_running(false);
  idle.safeguard_stop(true);
  idle.safeguard_stop(false);
  EXPECT_FALSE(idle.playing());
}

TEST(SafetyMachine, ViolationAndFaultNeedANewStartOfSafety) {
  for (const bool fault : {true, false}) {
    SafetyMachine machine;
    EXPECT_FALSE(machine.restart_safety());
    fault ? machine.fault() : machine.violation();
    machine.emergency_stop();  // not graver
    EXPECT_EQ(machine.status().safety_status, fault ? 9 : 8);
    EXPECT_FALSE(machine.power_on());
    EXPECT_TRUE(machine.restart_safety());
    EXPECT_EQ(machine.status().robot_mode, 3);
    EXPECT_TRUE(machine.power_on());
  }
}

TEST(SafetyMachine, TheSpeedSliderIsBounded) {
  SafetyMachine machine;
  for (const auto& [set, expected] : {std::pair{0.3, 0.3}, {7.0, 1.0}, {-1.0, 0.0}, {std::nan(""), 0.0}}) {
    machine.set_speed_slider(set);
    EXPECT_EQ(machine.speed_slider(), expected);
  }
}

}  // namespace
}  // namespace embody::sim
