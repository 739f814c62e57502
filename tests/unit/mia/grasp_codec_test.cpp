// Commands beyond positions and stops: bytes as the vendor's drivers send them, and back.
#include "drivers/mia/grasp_codec.hpp"

#include <gtest/gtest.h>

#include <string>

namespace embody::mia {
namespace {

using Kind = Request::Kind;

std::string text(const Command& command) {
  return {command.data(), command.size()};
}

TEST(MiaRareCommands, CarryTheBytesOfTheVendorsDrivers) {
  EXPECT_EQ(text(encode_finger_force(Motor::kIndex, 55, 80)), "@3F+....5580....*\r");
  EXPECT_EQ(text(encode_joint_speed(Motor::kIndex, -1.2, 50)), "@J3S-1250.......*\r");
  EXPECT_EQ(text(encode_read('J')), "@ADJo...........*\r");
  EXPECT_EQ(text(encode_stream('P', true)), "@ADP1...........*\r");
  EXPECT_EQ(text(encode_stream('C', false)), "@ADC0...........*\r");
  EXPECT_EQ(text(encode_plain(kCalibratePayload)), "@AF.............*\r");
  EXPECT_EQ(text(encode_plain(kOldPingPayload)), "@?AreYouPlugged?*\r");
  EXPECT_EQ(text(encode_old_grasp('C', OldGraspAction::kOpen, 100, 50)), "@AGCa10050......*\r");
  EXPECT_EQ(text(encode_grasp('P', 100, 60)), "@AGeP100060.....*\r");
  EXPECT_EQ(text(encode_old_grasp_references(Motor::kMrl, 'L', 10, 200, 50)), "@2GL+010+200+050*\r");
  EXPECT_EQ(text(encode_grasp_references(Motor::kIndex, 'L', -10, 200)), "@3GL-010+200....*\r");
  EXPECT_EQ(text(encode_get_grasp_references(Motor::kThumb, 'S')), "@1gS............*\r");
}

TEST(MiaRareCommands, AreUnderstoodByTheHand) {
  const Request force = parse_command(encode_finger_force(Motor::kMrl, 30, 70));
  EXPECT_EQ(force.kind, Kind::kFingerForce);
  EXPECT_EQ(force.motor, Motor::kMrl);
  EXPECT_EQ(force.value, 30);
  EXPECT_EQ(force.current_percent, 70);
  for (int tenths = -99; tenths <= 99; ++tenths) {
    const Request drive = parse_command(encode_joint_speed(Motor::kThumb, 0.1 * tenths, 40));
    ASSERT_EQ(drive.kind, Kind::kJointSpeed);
    ASSERT_EQ(drive.value, tenths);
  }
  EXPECT_EQ(parse_command(encode_plain("AF")).kind, Kind::kCalibrate);
  EXPECT_EQ(parse_command(encode_plain("ES")).kind, Kind::kStore);
  const Request old_grasp = parse_command(encode_old_grasp('L', OldGraspAction::kModulate, 40, 30));
  EXPECT_EQ(old_grasp.kind, Kind::kGrasp);
  EXPECT_EQ(old_grasp.grasp, 'L');
  EXPECT_EQ(old_grasp.value, 40);
  EXPECT_EQ(parse_command(encode_old_grasp('L', OldGraspAction::kOpen, 100, 30)).value, 0) << "opens";
  const Request grasp = parse_command(encode_grasp('U', 70, 100));
  EXPECT_EQ(grasp.kind, Kind::kGrasp);
  EXPECT_EQ(grasp.grasp, 'U');
  EXPECT_EQ(grasp.value, 70);
  EXPECT_EQ(parse_command(encode_get_grasp_references(Motor::kIndex, 'T')).kind, Kind::kGetGraspReferences);
  for (const char* unknown : {"AGx", "AGeX100060", "AGCb10050", "AGeC101060", "AGeC1x0060", "2Gx+010+200", "2gX"}) {
    EXPECT_EQ(parse_command(encode_plain(unknown)).kind, Kind::kUnknown) << unknown;
  }
}

TEST(MiaGraspReferences, ComeBackInBothForms) {
  EXPECT_EQ(parse_set_references(encode_old_grasp_references(Motor::kMrl, 'L', 10, 200, 50)),
            (GraspReferences{10, 200, 50}));
  EXPECT_EQ(parse_set_references(encode_grasp_references(Motor::kIndex, 'L', -10, 200)),
            (GraspReferences{-10, 200, 0}));
  EXPECT_EQ(parse_set_references(encode_grasp_references(Motor::kMrl, 'L', -10, 999)), (GraspReferences{0, 255, 0}));
  EXPECT_FALSE(parse_set_references(encode_plain("AS")));
  EXPECT_FALSE(parse_set_references(encode_plain("2GL+01x+200")));
  const GraspReferences references{-12, 203, 45};
  const DataLine line = encode_grasp_reference_line(references);
  EXPECT_EQ(line.size, 29u);
  EXPECT_EQ(parse_grasp_references(line.view()), references);
  for (const std::size_t i : {0, 10, 11, 17, 20, 24, 27, 28}) {
    std::string broken(line.view());
    broken[i] = '#';
    EXPECT_FALSE(parse_grasp_references(broken)) << "byte " << i;
  }
}

TEST(MiaJointAngles, AreRoundedNotCut) {
  EXPECT_EQ(joint_hundredths(Motor::kMrl, 0.999), 100);
  EXPECT_EQ(joint_hundredths(Motor::kIndex, -0.656), -66);
  EXPECT_EQ(joint_hundredths(Motor::kThumb, -0.3), 0);
  for (double q = -1.4; q <= 1.4; q += 0.0013) {
    ASSERT_NEAR(0.01 * joint_hundredths(Motor::kIndex, q), q, 0.005 + 1e-12);
  }
}

}  // namespace
}  // namespace embody::mia
