#include "drivers/ur_rtde/primary_codec.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "drivers/sim/ur/primary_messages.hpp"
#include "drivers/ur_rtde/stop_codes.hpp"
#include "drivers/ur_rtde/ur_models.hpp"
#include "tests/unit/ur_rtde/hex.hpp"

namespace embody::ur {
namespace {

using test::hex;

std::optional<RobotMessage> decode(const std::vector<std::byte>& bytes) {
  const PrimaryMessage message = parse_primary(bytes);
  EXPECT_EQ(message.framing, PrimaryFraming::kComplete);
  EXPECT_EQ(message.size, bytes.size());
  EXPECT_EQ(message.type, kRobotMessage);
  return decode_robot_message(message.contents);
}

TEST(PrimaryCodec, ReadsTheMessagesOfTheVendorsTables) {
  const auto exception = decode(hex("0000001b 14 0000000000000001 fd 0a 00000003 00000001 'a:b:'"));
  ASSERT_TRUE(exception && exception->is(MessageKind::kRuntimeException));
  EXPECT_EQ(exception->timestamp_us, 1U);
  EXPECT_EQ(exception->line, 3);
  EXPECT_EQ(exception->column, 1);
  EXPECT_EQ(exception->text, "a:b:");

  const auto code =
      decode(hex("00000026 14 0000000000000000 fe 06 000000d2 00000000 00000002 00000000 00000000 'ro' 00"));
  ASSERT_TRUE(code && code->is(MessageKind::kErrorCode));
  EXPECT_EQ(code->code, 210);
  EXPECT_EQ(code->level, 2);
  EXPECT_EQ(code->text, "ro") << "without the terminator that some firmware sends";

  const auto key = decode(hex("0000001d 14 0000000000000000 fe 07 00000000 00000000 03 'RUN' 'xy'"));
  ASSERT_TRUE(key && key->is(MessageKind::kKey));
  EXPECT_EQ(key->title, "RUN");
  EXPECT_EQ(key->text, "xy");

  const auto version = decode(hex("0000001f 14 0000000000000000 fe 03 02 'UR' 05 0c 00000004 00000007 'now'"));
  ASSERT_TRUE(version && version->is(MessageKind::kVersion));
  EXPECT_EQ(version->title, "UR");
  EXPECT_EQ(version->major, 5);
  EXPECT_EQ(version->minor, 12);
  EXPECT_EQ(version->code, 4);
  EXPECT_EQ(version->text, "now");
}

TEST(PrimaryCodec, ReadsWhatTheSimulatedControllerWrites) {
  const auto code = decode(sim::encode_error_code(204, 3, 3, "sudden stop"));
  ASSERT_TRUE(code);
  EXPECT_EQ(code->code, 204);
  EXPECT_EQ(code->argument, 3);
  EXPECT_EQ(code->level, kViolationLevel);
  const auto version = decode(sim::encode_version({5, 12, 4, 1}));
  ASSERT_TRUE(version);
  EXPECT_EQ(version->title, "URControl");
  EXPECT_EQ(decode(sim::encode_key_message(std::string(300, 'x'), "t"))->title.size(), 255U);

  UrKinematics sent = nominal_kinematics(robot::kUrModels[2]);
  sent.theta_rad = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  sent.checksum = {1, 2, 3, 4, 5, 6};
  const auto state = sim::encode_robot_state({}, &sent);
  const PrimaryMessage message = parse_primary(state);
  ASSERT_EQ(message.type, kRobotState);
  const auto got = decode_kinematics(message.contents);
  ASSERT_TRUE(got);
  EXPECT_EQ(got->theta_rad, sent.theta_rad);
  EXPECT_EQ(got->a_m, sent.a_m);
  EXPECT_EQ(got->d_m, sent.d_m);
  EXPECT_EQ(got->alpha_rad, sent.alpha_rad);
  EXPECT_EQ(got->checksum, sent.checksum);
  EXPECT_FALSE(decode_kinematics(parse_primary(sim::encode_robot_state({}, nullptr)).contents));
  sent.d_m[3] = std::nan("");
  const auto broken = sim::encode_robot_state({}, &sent);
  EXPECT_FALSE(decode_kinematics(parse_primary(broken).contents));
}

TEST(PrimaryCodec, EveryShorterMessageIsIncompleteOrRefused) {
  const auto whole = sim::encode_error_code(204, 1, 3, "");
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_EQ(parse_primary(Bytes(whole).first(size)).framing, PrimaryFraming::kIncomplete) << size;
    if (size < kPrimaryHeader) continue;
    const Bytes contents = Bytes(whole).subspan(kPrimaryHeader, size - kPrimaryHeader);
    EXPECT_FALSE(decode_robot_message(contents)) << size;
  }
  EXPECT_EQ(parse_primary(hex("00000004 10")).framing, PrimaryFraming::kBroken);
  EXPECT_EQ(parse_primary(hex("7fffffff 10")).framing, PrimaryFraming::kBroken);
  EXPECT_FALSE(decode_robot_message(hex("0000000000000000 fe 07 00000000 00000000 ff 'x'"))) << "title beyond the end";
}

TEST(PrimaryCodec, SurvivesRandomDamage) {
  std::mt19937_64 random(21);
  const UrKinematics kinematics = nominal_kinematics(robot::kUrModels[0]);
  const std::vector<sim::Message> seeds{sim::encode_robot_state({}, &kinematics), sim::encode_version({5, 1, 2, 3}),
                                        sim::encode_error_code(1, 2, 3, "x"),     sim::encode_key_message("a", "b"),
                                        sim::encode_runtime_exception(1, 2, "c"), sim::encode_text_message("d")};
  for (int i = 0; i < 100'000; ++i) {
    auto bytes = seeds[random() % seeds.size()];
    for (int k = 0; k < 3; ++k) bytes[random() % bytes.size()] = static_cast<std::byte>(random());
    const PrimaryMessage message = parse_primary(bytes);
    if (message.framing != PrimaryFraming::kComplete) continue;
    (void)decode_robot_message(message.contents);
    (void)decode_kinematics(message.contents);
  }
}

TEST(StopCodes, HaveAMeaningAndTheMoreSpecificOneWins) {
  EXPECT_STREQ(stop_code_text(204, 1), "sudden change of the target position");
  EXPECT_STREQ(stop_code_text(204, 99), "the path of the set-points cannot be followed");
  EXPECT_NE(std::string(stop_code_text(191, 17)).find("safety limit"), std::string::npos);
  EXPECT_STREQ(stop_code_text(1, 0), "");
}

}  // namespace
}  // namespace embody::ur
