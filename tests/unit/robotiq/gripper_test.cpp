// The simulated gripper, in made-up time.
#include "drivers/sim/robotiq/gripper.hpp"

#include <gtest/gtest.h>

#include "tests/unit/robotiq/frames.hpp"

namespace embody::test {
namespace {

using robotiq::Activation;
using robotiq::GripperCommand;
using robotiq::ObjectState;
using std::chrono::milliseconds;

/// A gripper and its clock.
struct Bench {
  explicit Bench(sim::RobotiqGripperConfig config = {}) : gripper(config, TimePoint(std::chrono::hours(1))) {}

  void wait(Duration span) {
    now += span;
    static_cast<void>(gripper.advance(now));
  }
  std::vector<std::byte> ask(std::span<const std::byte> request) {
    gripper.receive(request, now);
    now += milliseconds(2);
    return gripper.advance(now);
  }
  void tell(const GripperCommand& command) { ask(modbus::encode_request(write_of(command)).view()); }

  TimePoint now{std::chrono::hours(1)};
  sim::RobotiqGripper gripper;
};

sim::RobotiqGripperConfig activated() {
  sim::RobotiqGripperConfig config;
  config.activated = true;
  return config;
}

TEST(RobotiqGripper, AnswersTheActivationOfTheManualByteForByte) {
  Bench bench;
  EXPECT_EQ(bench.ask(bytes_of("09 10 03 E8 00 03 06 00 00 00 00 00 00 73 30")), bytes_of("09 10 03 E8 00 03 01 30"));
  EXPECT_EQ(bench.ask(bytes_of("09 10 03 E8 00 03 06 01 00 00 00 00 00 72 E1")), bytes_of("09 10 03 E8 00 03 01 30"));
  EXPECT_EQ(bench.ask(bytes_of("09 03 07 D0 00 01 85 CF")), bytes_of("09 03 02 11 00 55 D5"));
  bench.wait(std::chrono::seconds(2));
  EXPECT_EQ(bench.ask(bytes_of("09 03 07 D0 00 01 85 CF")), bytes_of("09 03 02 31 00 4C 15"));
  EXPECT_GT(bench.gripper.travelled_counts(), 490.0) << "opened and closed";
}

TEST(RobotiqGripper, MovesAtTheSpeedsOfTheDataSheet) {
  for (const auto& [speed, mm_s] : {std::pair{0, 30.0}, std::pair{255, 250.0}}) {
    sim::RobotiqGripperConfig config = activated();
    config.start_counts = 10.0;
    Bench bench(config);
    bench.tell({true, true, 255, static_cast<std::uint8_t>(speed), 0});
    const double before = bench.gripper.counts();
    bench.wait(milliseconds(200));
    EXPECT_NEAR(bench.gripper.counts() - before, 0.2 * mm_s * 255 / 140, 0.02 * mm_s);
    EXPECT_EQ(bench.gripper.status().object, ObjectState::kMoving);
    EXPECT_GT(bench.gripper.status().current, 0);
  }
}

TEST(RobotiqGripper, StopsAtAnObjectAndSaysSo) {
  Bench bench(activated());
  bench.gripper.apply({sim::RobotiqFault::Kind::kObject, 60, true});
  bench.tell({true, true, 255, 255, 64});
  bench.wait(std::chrono::seconds(1));
  EXPECT_EQ(bench.gripper.status().object, ObjectState::kStoppedClosing);
  EXPECT_NEAR(bench.gripper.counts(), 255 * (1.0 - 60.0 / 140.0), 1e-6);
  bench.tell({true, true, 0, 255, 64});
  bench.wait(std::chrono::seconds(1));
  EXPECT_EQ(bench.gripper.status().object, ObjectState::kAtRequest);
  EXPECT_NEAR(bench.gripper.counts(), 3.0, 1e-6) << "the end of the fingers, not 0";
}

TEST(RobotiqGripper, DoesNotMoveWithoutGoOrActivationOrAfterAReset) {
  Bench bench(activated());
  bench.tell({true, true, 255, 128, 0});
  bench.wait(milliseconds(100));
  bench.tell({true, false, 255, 128, 0});
  const double stopped = bench.gripper.counts();
  bench.wait(std::chrono::seconds(2));
  EXPECT_EQ(bench.gripper.counts(), stopped);
  bench.tell({});
  bench.tell({false, true, 255, 128, 0});
  EXPECT_EQ(bench.gripper.status().fault, 0x7);
  bench.wait(std::chrono::seconds(2));
  EXPECT_EQ(bench.gripper.counts(), stopped);
}

TEST(RobotiqGripper, ReportsSilenceAsFaultNineUntilSomebodySpeaks) {
  Bench bench(activated());
  bench.wait(milliseconds(1100));
  EXPECT_EQ(bench.gripper.status().fault, 9);
  bench.ask(bytes_of("09 03 07 D0 00 01 85 CF"));
  EXPECT_EQ(bench.gripper.status().fault, 0);
}

TEST(RobotiqGripper, ExecutesFunction6And23AndRefusesOtherRegisters) {
  Bench bench(activated());
  modbus::Request single;
  single.slave = 9;
  single.function = modbus::Function::kWriteSingle;
  single.write_address = robotiq::kCommandAddress + 1;
  single.write_count = 1;
  single.values[0] = 77;
  const auto frame = modbus::encode_request(single);
  EXPECT_EQ(bench.ask(frame.view()), bytes_of(frame)) << "function 6 echoes";
  EXPECT_EQ(bench.gripper.status().position_echo, 77);

  modbus::Request both = write_of({true, true, 200, 255, 0});
  both.function = modbus::Function::kReadWriteMultiple;
  both.read_address = robotiq::kStatusAddress;
  both.read_count = 3;
  modbus::Assembler incoming;
  incoming.push(bench.ask(modbus::encode_request(both).view()));
  auto reply = incoming.take_reply(both);
  ASSERT_TRUE(reply);
  EXPECT_EQ(robotiq::unpack_status({reply->values[0], reply->values[1], reply->values[2]}).position_echo, 200);

  const auto elsewhere = modbus::read_request(9, modbus::Function::kReadHolding, 0x07D2, 2);
  incoming.push(bench.ask(modbus::encode_request(elsewhere).view()));
  reply = incoming.take_reply(elsewhere);
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->exception, 2);
  EXPECT_TRUE(
      bench.ask(bytes_of(modbus::encode_request(modbus::read_request(8, modbus::Function::kReadHolding, 0x07D0, 1))))
          .empty())
      << "another slave's request is not answered";
}

TEST(RobotiqFaultWords, AreUnderstoodOrRefusedWithASentence) {
  using Kind = sim::RobotiqFault::Kind;
  const auto good = [](std::string_view words, Kind kind, int number, bool on) {
    const auto fault = sim::parse_robotiq_fault(words);
    EXPECT_TRUE(fault.ok()) << words;
    if (!fault) return;
    EXPECT_EQ(fault->kind, kind) << words;
    EXPECT_EQ(fault->number, number) << words;
    EXPECT_EQ(fault->on, on) << words;
  };
  good("drop 3", Kind::kDrop, 3, true);
  good(" garble  1 ", Kind::kGarble, 1, true);
  good("crc 2", Kind::kCrc, 2, true);
  good("exception 1", Kind::kException, 1, true);
  good("mute on", Kind::kMute, 0, true);
  good("mute off", Kind::kMute, 0, false);
  good("unplug", Kind::kUnplug, 0, true);
  good("plug", Kind::kPlug, 0, true);
  good("fault 14", Kind::kFault, 14, true);
  good("deactivate", Kind::kDeactivate, 0, true);
  good("object 60", Kind::kObject, 60, true);
  good("object none", Kind::kObject, -1, true);
  good("delay 100", Kind::kDelay, 100, true);
  for (const char* bad : {"", "drop", "drop x", "drop -1", "drop 1 2", "mute", "mute maybe", "unplug now", "fault 16",
                          "object 9999", "delay 1.5", "explode", "drop 99999999999999999999"}) {
    const auto fault = sim::parse_robotiq_fault(bad);
    EXPECT_FALSE(fault.ok()) << bad;
    EXPECT_EQ(fault.error().code, Errc::kInvalidArgument) << bad;
  }
  EXPECT_NE(sim::robotiq_fault_help().find("object MM|none"), std::string::npos);
}

}  // namespace
}  // namespace embody::test
