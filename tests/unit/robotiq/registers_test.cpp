#include "drivers/robotiq/registers.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string_view>

namespace embody::test {
namespace {

using robotiq::Activation;
using robotiq::GripperCommand;
using robotiq::GripperStatus;
using robotiq::ObjectState;

TEST(RobotiqRegisters, EveryCommandComesBackFromItsRegisters) {
  for (unsigned i = 0; i < 1024; ++i) {
    GripperCommand command{(i & 1) != 0, (i & 2) != 0, static_cast<std::uint8_t>(i >> 2),
                           static_cast<std::uint8_t>(7 * i), static_cast<std::uint8_t>(31 * i)};
    ASSERT_EQ(robotiq::unpack_command(robotiq::pack(command)), command);
  }
}

TEST(RobotiqRegisters, EveryStatusWordMeansOneStatus) {
  for (unsigned first = 0; first < 256; ++first) {
    for (unsigned faults = 0; faults < 256; faults += 5) {
      const robotiq::Registers registers{static_cast<std::uint16_t>((first & 0xF9) << 8),
                                         static_cast<std::uint16_t>(faults << 8 | first),
                                         static_cast<std::uint16_t>(first << 8 | faults)};
      ASSERT_EQ(robotiq::pack(robotiq::unpack_status(registers)), registers);
    }
  }
}

TEST(RobotiqRegisters, TheExamplesOfTheManualMeanWhatItSays) {
  const GripperStatus held = robotiq::unpack_status({0xB900, 0x00FF, 0xBD00});
  EXPECT_TRUE(held.activated());
  EXPECT_TRUE(held.go);
  EXPECT_EQ(held.object, ObjectState::kStoppedClosing);
  EXPECT_EQ(held.position_echo, 255);
  EXPECT_EQ(held.position, 189);
  const GripperStatus opening = robotiq::unpack_status({0x3900, 0x0000, 0xBB10});
  EXPECT_EQ(opening.object, ObjectState::kMoving);
  EXPECT_EQ(opening.position, 187);
  EXPECT_NEAR(opening.current_a(), 0.160, 1e-12);
  EXPECT_EQ(robotiq::unpack_status({0x1100, 0, 0}).activation, Activation::kRunning);
  EXPECT_FALSE(robotiq::unpack_status({0x1100, 0, 0}).activated());
  EXPECT_TRUE(robotiq::unpack_status({0x3100, 0, 0}).activated());
}

TEST(RobotiqRegisters, FaultsHaveTextsAndOnlyTwoOfThemAllowMotion) {
  int allowing = 0;
  for (std::uint8_t fault = 0; fault < 16; ++fault) {
    EXPECT_FALSE(std::string_view(robotiq::fault_text(fault)).empty());
    if (robotiq::allows_motion(fault)) ++allowing;
    EXPECT_EQ(robotiq::needs_activation(fault), fault >= 10);
  }
  EXPECT_EQ(allowing, 2);
}

TEST(RobotiqRegisters, CountsAndAnglesAgreeToHalfACountAndAreClamped) {
  for (const robotiq::PositionScale scale : {robotiq::PositionScale{}, robotiq::PositionScale{13, 230, 0.0, 0.7}}) {
    const double half_rad = 0.5 * (scale.closed_rad - scale.open_rad) / (scale.closed_counts - scale.open_counts);
    for (double q = -0.2; q < 1.0; q += 0.001) {
      const int counts = robotiq::counts_of(scale, q);
      ASSERT_GE(counts, scale.open_counts);
      ASSERT_LE(counts, scale.closed_counts);
      if (q < scale.open_rad || q > scale.closed_rad) continue;
      ASSERT_LE(std::abs(robotiq::angle_of(scale, counts) - q), half_rad + 1e-12);
    }
    EXPECT_DOUBLE_EQ(robotiq::angle_of(scale, scale.open_counts), 0.0);
    EXPECT_DOUBLE_EQ(robotiq::angle_of(scale, scale.closed_counts), 0.7);
  }
}

}  // namespace
}  // namespace embody::test
