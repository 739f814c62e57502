#include "drivers/ur_rtde/arm_package.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "drivers/ur_rtde/status_text.hpp"

namespace embody::rtde {
namespace {

ControllerStatus ready() {
  return {7, 1, 1U, 2, kProgramVersion};
}

TEST(UrArmCondition, IsReadyOnlyWhenEverythingIs) {
  EXPECT_EQ(arm_condition(ready()), ArmCondition::kReady);
  ControllerStatus reduced = ready();
  reduced.safety_status = 2;
  reduced.safety_status_bits = 2;
  EXPECT_EQ(arm_condition(reduced), ArmCondition::kReady);
  for (int mode = -5; mode < 30; ++mode) {
    ControllerStatus status = ready();
    status.robot_mode = mode;
    EXPECT_EQ(arm_condition(status) == ArmCondition::kReady, mode == 7) << mode;
    status = ready();
    status.safety_status = mode;
    EXPECT_EQ(arm_condition(status) == ArmCondition::kReady, mode == 1 || mode == 2) << mode;
    status = ready();
    status.runtime_state = static_cast<std::uint32_t>(mode);
    EXPECT_EQ(arm_condition(status) == ArmCondition::kReady, mode == 2) << mode;
    status = ready();
    status.program_version = mode;
    EXPECT_EQ(arm_condition(status) == ArmCondition::kReady, mode == 1) << mode;
  }
}

TEST(UrArmCondition, NoStopBitOfTheSafetyControllerIsOverlooked) {
  for (unsigned bit = 2; bit <= 10; ++bit) {
    ControllerStatus status = ready();
    status.safety_status_bits |= 1U << bit;
    EXPECT_NE(arm_condition(status), ArmCondition::kReady) << "bit " << bit;
  }
  ControllerStatus enabling = ready();
  enabling.safety_status_bits |= 1U << 11U;  // an active enabling device is no stop
  EXPECT_EQ(arm_condition(enabling), ArmCondition::kReady);
}

TEST(UrArmCondition, TheGravestStopWins) {
  EXPECT_EQ(arm_condition({7, 3, 0b100'0000'0100, 4, 1}), ArmCondition::kProtectiveStop);
  EXPECT_EQ(arm_condition({7, 5, 0b100'0001'0000, 4, 1}), ArmCondition::kProtectiveStop);
  EXPECT_EQ(arm_condition({3, 7, 0b100'1100'0000, 1, 1}), ArmCondition::kEmergencyStop);
  EXPECT_EQ(arm_condition({3, 6, 0b100'1010'0000, 1, 1}), ArmCondition::kEmergencyStop);
  EXPECT_EQ(arm_condition({7, 9, 0b110'0000'0000, 1, 1}), ArmCondition::kFault);
  EXPECT_EQ(arm_condition({7, 99, 1, 2, 1}), ArmCondition::kFault);
  EXPECT_EQ(arm_condition({3, 1, 1, 1, 0}), ArmCondition::kNotRunning);
  EXPECT_EQ(arm_condition({7, 1, 1, 4, 1}), ArmCondition::kProgramStopped);
}

TEST(UrArmCondition, EveryCodeHasAText) {
  EXPECT_STREQ(safety_text(3), "protective stop");
  EXPECT_STREQ(robot_mode_text(7), "running");
  EXPECT_STREQ(runtime_text(2), "playing");
  for (int code = -300; code < 300; ++code) {
    EXPECT_NE(safety_text(code)[0], '\0');
    EXPECT_NE(robot_mode_text(code)[0], '\0');
    EXPECT_NE(runtime_text(code)[0], '\0');
    EXPECT_NE(program_fault_text(code)[0], '\0');
  }
}

class UrStatePackage : public testing::Test {
 protected:
  // Offsets counted by hand from the table of types, not by the code under test.
  enum Offset : std::size_t {
    kTime = 0,
    kQ = 8,
    kQd = 56,
    kTarget = 104,
    kMode = 200,
    kSafety = 208,
    kRuntime = 212,
    kBits = 220,
    kScaling = 224,
    kEcho = 240,
    kState = 244,
    kFault = 248,
    kVersion = 252
  };

  UrStatePackage() {
    put(kTime, 16412.206);
    for (std::size_t i = 0; i < 6; ++i) {
      put(kQ + 8 * i, 0.1 * static_cast<double>(i));
      put(kQd + 8 * i, -0.2 * static_cast<double>(i));
      put(kTarget + 8 * i, 0.3 * static_cast<double>(i));
    }
    put(kMode, std::int32_t{7});
    put(kSafety, std::int32_t{1});
    put(kRuntime, std::uint32_t{2});
    put(kBits, std::uint32_t{1});
    put(kScaling, 0.5);
    put(kEcho, std::int32_t{0x7FFF'FFFF});
    put(kState, std::int32_t{2});
    put(kFault, std::int32_t{4});
    put(kVersion, std::int32_t{1});
  }
  template <class T>
  void put(std::size_t offset, T value) {
    store(fields_, offset, value);
  }
  std::array<std::byte, 256> fields_{};
  ArmState state_;
};

TEST_F(UrStatePackage, HasThePublishedSizeAndFillsEveryField) {
  ASSERT_EQ(fields_size(kOutputRecipe) + kFieldsStart, 260U);
  ASSERT_TRUE(decode_state(fields_, state_));
  EXPECT_EQ(state_.controller_time, Duration(16'412'206'000'000));
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(state_.q_rad[i], 0.1 * i);
    EXPECT_EQ(state_.qd_rad_s[i], -0.2 * i);
    EXPECT_EQ(state_.q_target_rad[i], 0.3 * i);
  }
  EXPECT_EQ(state_.condition, ArmCondition::kReady);
  EXPECT_TRUE(state_.tracking);
  EXPECT_EQ(state_.program_fault, 4);
  EXPECT_EQ(state_.echo_sequence, 0x7FFF'FFFFU);
  EXPECT_EQ(state_.robot_mode, 7);
  EXPECT_EQ(state_.safety_status, 1);
  EXPECT_EQ(state_.speed_scaling, 0.5);
}

TEST_F(UrStatePackage, AStoppedProgramDoesNotTrackWhateverItsRegisterSays) {
  put(kRuntime, std::uint32_t{4});
  ASSERT_TRUE(decode_state(fields_, state_));
  EXPECT_FALSE(state_.tracking);
  EXPECT_EQ(state_.condition, ArmCondition::kProgramStopped);
}

TEST_F(UrStatePackage, NumbersThatAreNotFiniteAreRefusedAndChangeNothing) {
  for (const std::size_t offset : {std::size_t{0}, std::size_t{8}, std::size_t{96}, std::size_t{144}}) {
    for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), -HUGE_VAL}) {
      UrStatePackage::SetUp();
      const auto before = fields_;
      put(offset, bad);
      EXPECT_FALSE(decode_state(fields_, state_)) << "offset " << offset;
      EXPECT_EQ(state_.condition, ArmCondition::kUnknown);
      fields_ = before;
    }
  }
}

TEST(UrCommandPackage, IsTheInputRecipeByteForByte) {
  ArmCommand command;
  command.sequence = 0x8000'0007;
  command.action = ArmAction::kTrack;
  for (int i = 0; i < 6; ++i) {
    command.q_rad[i] = 1.0 + i;
    command.qd_rad_s[i] = -1.0 - i;
  }
  CommandPackage package{};
  encode_command(command, 3, package);
  ASSERT_EQ(package.size(), 108U);
  EXPECT_EQ(load<std::uint16_t>(package, 0), 108);
  EXPECT_EQ(load<std::uint8_t>(package, 2), 'U');
  EXPECT_EQ(load<std::uint8_t>(package, 3), 3);
  EXPECT_EQ(load<std::int32_t>(package, 4), 7) << "sequences have 31 bits";
  EXPECT_EQ(load<std::int32_t>(package, 8), 1);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(load<double>(package, 12 + 8 * i), 1.0 + static_cast<double>(i));
    EXPECT_EQ(load<double>(package, 60 + 8 * i), -1.0 - static_cast<double>(i));
  }
}

TEST(UrCommandPackage, HoldAndExitCarryNoTarget) {
  ArmCommand command;
  command.q_rad.setConstant(std::nan(""));
  command.qd_rad_s.setConstant(3.0);
  for (const auto& [action, mode] : {std::pair{ArmAction::kHold, 0}, std::pair{ArmAction::kExit, 9}}) {
    command.action = action;
    CommandPackage package{};
    encode_command(command, 1, package);
    EXPECT_EQ(load<std::int32_t>(package, 8), mode);
    for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(load<double>(package, 12 + 8 * i), 0.0);
  }
}

}  // namespace
}  // namespace embody::rtde
