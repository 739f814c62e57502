// One command at a time: retry, late answers, and the quiet after two failures.
#include "drivers/mia/exchange.hpp"

#include <gtest/gtest.h>

#include <string>

namespace embody::mia {
namespace {

using Event = Exchange::Event;
using std::chrono::milliseconds;

constexpr TimePoint kStart{std::chrono::seconds(100)};
constexpr Duration kTimeout = milliseconds(20);

std::string ack(const Command& command) {
  const Ack bytes = encode_ack(command);
  return {bytes.data(), bytes.size()};
}

Outgoing motion(int counts) {
  return {.command = encode_motor_position(Motor::kMrl, counts, 60), .purpose = Purpose::kMotion, .motor = 2};
}

const Outgoing kRead{.command = encode_read('P'), .purpose = Purpose::kPositions};
const std::string kPositions(encode_triple(TripleLine::kPosition, {1, 2, 3}).view());

TEST(MiaExchange, IsOverWithTheAckOrWithTheDataBehindIt) {
  Exchange exchange;
  exchange.start(motion(5), kStart, kTimeout);
  EXPECT_EQ(exchange.take_line(kPositions, kStart), Event::kStranger) << "nobody asked";
  EXPECT_EQ(exchange.take_line(ack(motion(5).command), kStart), Event::kAcknowledged);
  EXPECT_FALSE(exchange.busy());
  exchange.start(kRead, kStart, kTimeout);
  EXPECT_EQ(exchange.take_line(kPositions, kStart), Event::kStranger) << "not before the ACK";
  EXPECT_EQ(exchange.take_line(ack(kRead.command), kStart + milliseconds(15)), Event::kNothing);
  EXPECT_EQ(exchange.take_time(kStart + milliseconds(34)), Event::kNothing) << "the data has its own time";
  EXPECT_EQ(exchange.take_line(kPositions, kStart + milliseconds(34)), Event::kData);
  EXPECT_FALSE(exchange.busy());
}

TEST(MiaExchange, LateAckOfAnEarlierCommandIsNotTakenForThePresentOne) {
  Exchange exchange;
  exchange.start(motion(5), kStart, kTimeout);
  EXPECT_EQ(exchange.take_time(kStart + kTimeout), Event::kTimedOut);
  exchange.start(motion(6), kStart + kTimeout, kTimeout);
  EXPECT_EQ(exchange.take_line(ack(motion(5).command), kStart + milliseconds(25)), Event::kLateAck);
  EXPECT_TRUE(exchange.busy());
  EXPECT_EQ(exchange.take_line(ack(motion(6).command), kStart + milliseconds(26)), Event::kAcknowledged);
}

TEST(MiaExchange, HasOneRetryAndThenWaitsUntilTheOwedAnswersHaveCome) {
  for (const bool answers : {true, false}) {
    Exchange exchange;
    exchange.start(kRead, kStart, kTimeout);
    ASSERT_EQ(exchange.take_time(kStart + milliseconds(20)), Event::kTimedOut);
    ASSERT_TRUE(exchange.retry(kStart + milliseconds(20)));
    ASSERT_EQ(exchange.take_time(kStart + milliseconds(40)), Event::kTimedOut);
    ASSERT_FALSE(exchange.retry(kStart + milliseconds(40))) << "one retry";
    exchange.resynchronise(kStart + milliseconds(40));
    EXPECT_TRUE(exchange.draining());
    if (answers) {
      EXPECT_EQ(exchange.take_line(ack(kRead.command), kStart + milliseconds(55)), Event::kLateAck);
      EXPECT_EQ(exchange.take_line(kPositions, kStart + milliseconds(56)), Event::kStranger) << "old data is no reply";
      EXPECT_TRUE(exchange.busy()) << "one more is owed";
      EXPECT_EQ(exchange.take_line(ack(kRead.command), kStart + milliseconds(75)), Event::kLateAck);
      EXPECT_EQ(exchange.late_by(), milliseconds(75));
    } else {
      EXPECT_EQ(exchange.take_time(kStart + milliseconds(99)), Event::kNothing);
      EXPECT_TRUE(exchange.busy());
      EXPECT_EQ(exchange.take_time(kStart + milliseconds(100)), Event::kNothing) << "no second time-out";
      EXPECT_EQ(exchange.late_by(), Duration::zero());
    }
    EXPECT_FALSE(exchange.busy());
  }
}

TEST(MiaExchange, DataOfAnotherChannelIsNotTheAnswer) {
  const std::string speeds(encode_triple(TripleLine::kSpeed, {0, 0, 0}).view());
  const std::string currents(encode_triple(TripleLine::kCurrent, {9, 9, 9}).view());
  const std::string strain(encode_strain_gauges({}).view());
  const std::string angles(encode_joint_positions({}).view());
  struct Case {
    char channel;
    Purpose purpose;
    std::string data;
  };
  for (const Case& c : {Case{'P', Purpose::kPositions, kPositions}, Case{'J', Purpose::kJointPositions, angles},
                        Case{'C', Purpose::kCurrents, currents}, Case{'A', Purpose::kForces, strain}}) {
    Exchange exchange;
    const Outgoing read{.command = encode_read(c.channel), .purpose = c.purpose};
    exchange.start(read, kStart, kTimeout);
    ASSERT_EQ(exchange.take_line(ack(read.command), kStart), Event::kNothing);
    for (const std::string& line : {speeds, currents, strain, angles, kPositions}) {
      if (line == c.data) continue;
      EXPECT_EQ(exchange.take_line(line, kStart), Event::kStranger) << c.channel;
    }
    EXPECT_EQ(exchange.take_line(c.data, kStart), Event::kData) << c.channel;
  }
}

}  // namespace
}  // namespace embody::mia
