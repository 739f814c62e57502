// The simulated hand without its pseudo-terminal, in simulated time.
#include "drivers/sim/mia/device.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace embody::sim {
namespace {

using mia::Motor;
using std::chrono::milliseconds;

constexpr TimePoint kStart{std::chrono::seconds(1000)};

void send(MiaDevice& hand, const mia::Command& command, TimePoint now) {
  hand.receive({command.data(), command.size()}, now);
}

std::string ack(const mia::Command& command) {
  const mia::Ack bytes = mia::encode_ack(command);
  return {bytes.data(), bytes.size()};
}

TEST(MiaMotor, ReachesItsTargetAtTheCommandedSpeed) {
  // 40 % of 90 units are 36 units; the counts per second come from the vendor's reductions.
  const std::array<double, 3> counts_per_s{207.0, 272.0, 336.0};
  for (std::size_t i = 0; i < mia::kMotors; ++i) {
    MiaMotor motor(static_cast<Motor>(i), 0.0, 0.04);
    motor.move_to(255.0, 40);
    motor.advance(0.5);
    EXPECT_NEAR(motor.counts(), 0.5 * counts_per_s[i], 1.0);
    EXPECT_NEAR(motor.counts_per_s(), counts_per_s[i], 1.0);
    motor.advance(2.0);
    EXPECT_NEAR(motor.counts(), 255.0, 1e-6);
    EXPECT_NEAR(motor.counts_per_s(), 0.0, 1e-3);
  }
}

TEST(MiaMotor, DoesNotDependOnHowTimeIsCut) {
  for (const bool speed_mode : {false, true}) {
    MiaMotor coarse(Motor::kIndex, -200.0, 0.04), fine(Motor::kIndex, -200.0, 0.04);
    for (MiaMotor* motor : {&coarse, &fine}) speed_mode ? motor->drive(40.0) : motor->move_to(120.0, 60);
    for (int i = 0; i < 20; ++i) {
      coarse.advance(0.05);
      for (int k = 0; k < 500; ++k) fine.advance(0.0001);
      ASSERT_NEAR(coarse.counts(), fine.counts(), 1e-6) << "step " << i;
    }
  }
}

TEST(MiaMotor, DrivenBySpeedStopsAtTheEndOfItsRange) {
  MiaMotor thumb(Motor::kThumb, 100.0, 0.04);
  thumb.drive(-50.0);
  thumb.advance(5.0);
  EXPECT_EQ(thumb.counts(), 0.0);
  EXPECT_TRUE(thumb.blocked());
}

TEST(MiaDevice, AcknowledgesAfterTheDelayAndThenReports) {
  MiaSimulatorConfig config;
  config.start_counts = {10.0, -20.0, 30.0};
  MiaDevice hand(config, kStart);
  const mia::Command read = mia::encode_plain(mia::kReadPositionsPayload);
  send(hand, read, kStart);
  EXPECT_EQ(hand.next_event(), kStart + milliseconds(2));
  EXPECT_EQ(hand.advance(kStart + std::chrono::microseconds(1999)), "");
  EXPECT_EQ(hand.advance(kStart + milliseconds(2)), ack(read) + "e.....+00010...+00030...-00020\n");
  EXPECT_EQ(hand.next_event(), std::nullopt);
}

TEST(MiaDevice, DropsACommandThatComesBeforeTheAckOfTheLastOne) {
  const mia::Command first = mia::encode_motor_position(Motor::kThumb, 50, 60);
  const mia::Command second = mia::encode_motor_position(Motor::kMrl, 50, 60);
  for (const bool half_duplex : {true, false}) {
    MiaSimulatorConfig config;
    config.half_duplex = half_duplex;
    MiaDevice hand(config, kStart);
    send(hand, first, kStart);
    send(hand, second, kStart + milliseconds(1));
    EXPECT_EQ(hand.advance(kStart + milliseconds(5000)), half_duplex ? ack(first) : ack(first) + ack(second));
    EXPECT_EQ(hand.counters().dropped_as_early, half_duplex ? 1u : 0u);
    EXPECT_NEAR(hand.motor_counts()[2], half_duplex ? 0.0 : 50.0, 1e-6);
  }
}

TEST(MiaDevice, StopsAllMotorsAtOnceAndFinishesPositionCommandsWithoutAHost) {
  for (const bool stop : {true, false}) {
    MiaDevice hand({}, kStart);
    send(hand, mia::encode_motor_position(Motor::kMrl, 200, 60), kStart);
    hand.advance(kStart + milliseconds(100));
    const double on_the_way = hand.motor_counts()[2];
    ASSERT_GT(on_the_way, 20.0);
    ASSERT_LT(on_the_way, 100.0);
    if (stop) send(hand, mia::encode_plain(mia::kStopAllPayload), kStart + milliseconds(100));
    hand.forget_host();
    hand.advance(kStart + milliseconds(3000));
    EXPECT_NEAR(hand.motor_counts()[2], stop ? on_the_way : 200.0, 1e-6);
  }
}

TEST(MiaDevice, UnderstandsJointAnglesAndReportsThemSigned) {
  MiaDevice hand({}, kStart);
  TimePoint now = kStart;
  const auto command = [&](const mia::Command& bytes) {
    send(hand, bytes, now);
    now += milliseconds(3000);
    return hand.advance(now);
  };
  command(mia::encode_joint_position(Motor::kThumb, 0.5, 60));
  command(mia::encode_joint_position(Motor::kMrl, 1.0, 60));
  command(mia::encode_joint_position(Motor::kIndex, -0.65, 60));
  const mia::Command read = mia::encode_plain("ADJo");
  EXPECT_EQ(command(read), ack(read) + "JP+050+100-065\n");
  EXPECT_NEAR(hand.joint_angles_rad()[1], -0.65, 1e-6) << "the crank's coordinate";
  const mia::Command speeds = mia::encode_plain("ADjo");
  EXPECT_EQ(command(speeds), ack(speeds) + "JS+00+00+00\n");
}

TEST(MiaDevice, StreamsAtItsRateUntilToldToStop) {
  MiaDevice hand({}, kStart);
  send(hand, mia::encode_plain("ADP1"), kStart);
  std::size_t lines = 0;
  TimePoint now = kStart;
  for (int i = 0; i < 1000; ++i) {
    now += milliseconds(1);
    const std::string said = hand.advance(now);
    lines += said.find('e') != std::string::npos ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(lines), 50.0, 2.0);
  send(hand, mia::encode_plain("Ad"), now);
  hand.advance(now + milliseconds(5));
  EXPECT_EQ(hand.next_event(), std::nullopt);
}

TEST(MiaDevice, LogsAHundredSamplesPerSecondAndKeepsTheNewest) {
  MiaSimulatorConfig config;
  config.log_capacity = 50;
  MiaDevice hand(config, kStart);
  send(hand, mia::encode_motor_position(Motor::kThumb, 255, 60), kStart);
  hand.move_to(kStart + milliseconds(995));
  const auto log = hand.log();
  ASSERT_EQ(log.size(), 50u);
  for (std::size_t i = 0; i < log.size(); ++i) {
    EXPECT_EQ(log[i].t, kStart + milliseconds(500 + 10 * static_cast<int>(i)));
    EXPECT_GT(log[i].q_rad[0], i > 0 ? log[i - 1].q_rad[0] : 0.0);
  }
}

TEST(MiaDevice, FaultsTouchWhatItSaysAndNotWhatItDoes) {
  MiaDevice hand({}, kStart);
  const mia::Command move = mia::encode_motor_position(Motor::kThumb, 100, 60);
  TimePoint now = kStart;
  const auto said = [&] {
    send(hand, move, now);
    now += milliseconds(10);
    return hand.advance(now);
  };
  hand.drop_next(1);
  EXPECT_EQ(said(), "");
  hand.garble_next(1);
  EXPECT_EQ(said(), "<###############\n");
  EXPECT_EQ(said(), ack(move));
  hand.mute(true);
  EXPECT_EQ(said(), "");
  hand.mute(false);
  EXPECT_EQ(said(), ack(move));
  EXPECT_EQ(hand.counters().motions, 5u);
  EXPECT_EQ(hand.counters().acks, 3u);
}

}  // namespace
}  // namespace embody::sim
