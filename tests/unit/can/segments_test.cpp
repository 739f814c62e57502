#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "drivers/mia/can_line.hpp"
#include "drivers/mia/can_segments.hpp"

namespace embody::mia {
namespace {

using std::chrono::milliseconds;
constexpr unsigned kSeed = 11;
constexpr Duration kTimeout = milliseconds(20);
constexpr TimePoint kStart{std::chrono::seconds(100)};

std::vector<Segment> frames_of(std::string_view message, unsigned sequence) {
  const Segments segments = split_message(message, sequence);
  return {segments.frames.begin(), segments.frames.begin() + static_cast<std::ptrdiff_t>(segments.count)};
}

std::vector<std::string> joined(const std::vector<Segment>& frames, Duration step = Duration{0}) {
  SegmentAssembler assembler(kTimeout);
  std::vector<std::string> messages;
  TimePoint t = kStart;
  for (const Segment& frame : frames) {
    if (const auto message = assembler.push({frame.data.data(), frame.size}, t)) messages.emplace_back(*message);
    t += step;
  }
  return messages;
}

TEST(Segments, ACommandMakesThreeFramesOfSevenSevenAndOneByte) {
  const auto frames = frames_of("3P-012040......", 5);
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[0].size, 8);
  EXPECT_EQ(frames[1].size, 8);
  EXPECT_EQ(frames[2].size, 2);
  EXPECT_EQ(frames[0].data[0], 0x50);
  EXPECT_EQ(frames[1].data[0], 0x51);
  EXPECT_EQ(frames[2].data[0], 0x52);
  EXPECT_EQ(frames[0].data[1], '3');
  EXPECT_EQ(frames[2].data[1], '.');
}

TEST(Segments, MessagesOfEveryLengthComeBackAndLongerOnesAreRefused) {
  for (std::size_t size = 1; size <= kMaxMessage; ++size) {
    std::string message(size, ' ');
    for (std::size_t i = 0; i < size; ++i) message[i] = static_cast<char>(i * 7 + size);
    const auto messages = joined(frames_of(message, static_cast<unsigned>(size)));
    ASSERT_EQ(messages.size(), 1u) << size;
    ASSERT_EQ(messages[0], message);
  }
  EXPECT_EQ(split_message(std::string(kMaxMessage + 1, 'x'), 0).count, 0u);
  EXPECT_EQ(split_message("", 0).count, 0u);
}

TEST(Segments, LostDuplicatedAndReorderedFramesDropMessagesAndNeverMixThem) {
  std::mt19937 random(kSeed);
  std::size_t complete = 0;
  for (int round = 0; round < 5000; ++round) {
    std::vector<std::string> sent;
    std::vector<Segment> frames;
    for (unsigned i = 0; i < 12; ++i) {
      sent.push_back(std::string(1 + random() % 40, static_cast<char>('a' + i)));
      for (const Segment& frame : frames_of(sent.back(), static_cast<unsigned>(round) + i)) {
        const auto fate = static_cast<unsigned>(random() % 20);
        if (fate == 0) continue;  // lost
        frames.push_back(frame);
        if (fate == 1) frames.push_back(frame);  // twice
        if (fate == 2 && frames.size() > 1) std::swap(frames.back(), frames[frames.size() - 2]);
      }
    }
    auto next = sent.begin();
    for (const std::string& message : joined(frames)) {  // what comes is what was sent, in order, each at most once
      next = std::find(next, sent.end(), message);
      ASSERT_NE(next, sent.end()) << "seed " << kSeed << " round " << round << ": " << message;
      ++next;
      ++complete;
    }
  }
  EXPECT_GT(complete, 5000u * 4) << "and most messages come";
}

TEST(Segments, EachSingleLossOrRepetitionCostsExactlyThatMessage) {
  const std::string a = "first message..", b = "second message.";
  auto both = frames_of(a, 3);
  for (const Segment& frame : frames_of(b, 4)) both.push_back(frame);
  for (std::size_t i = 0; i < both.size(); ++i) {
    auto lossy = both;
    lossy.erase(lossy.begin() + static_cast<std::ptrdiff_t>(i));
    EXPECT_EQ(joined(lossy), std::vector<std::string>{i < 3 ? b : a}) << "without frame " << i;
  }
  auto again = frames_of(a, 3);
  for (const Segment& frame : frames_of(a, 3)) again.push_back(frame);
  EXPECT_EQ(joined(again), std::vector<std::string>{a}) << "a whole message twice";
}

TEST(Segments, AMessageThatTakesTooLongIsDropped) {
  const auto frames = frames_of("3P-012040......", 5);
  EXPECT_EQ(joined(frames, milliseconds(9)).size(), 1u);
  EXPECT_TRUE(joined(frames, milliseconds(11)).empty());
  // The counter has come round: a frame of long ago is not completed by today's.
  SegmentAssembler assembler(kTimeout);
  const auto old = frames_of("old old old old", 1), fresh = frames_of("new new new new", 1);
  assembler.push({old[0].data.data(), old[0].size}, kStart);
  assembler.push({fresh[1].data.data(), fresh[1].size}, kStart + milliseconds(50));
  EXPECT_FALSE(assembler.push({fresh[2].data.data(), fresh[2].size}, kStart + milliseconds(51)));
  EXPECT_EQ(assembler.dropped(), 2u);
}

TEST(CanLines, FramingBytesAreTakenOffAndPutBack) {
  std::array<char, kMaxMessage> buffer{};
  const Command command = encode_motor_position(Motor::kIndex, -120, 40);
  const std::string_view payload(command.data() + 1, kPayloadSize);
  EXPECT_EQ(payload, "3P-012040......");
  EXPECT_EQ(command_of_message(payload), command);
  EXPECT_FALSE(command_of_message("too short"));
  const Ack ack = encode_ack(command);
  const std::string_view ack_line(ack.data(), ack.size());
  EXPECT_EQ(message_of_line(ack_line), payload);
  EXPECT_EQ(line_of_message(payload, buffer), ack_line);
  EXPECT_EQ(line_of_message(ack_line, buffer), ack_line) << "a gateway that leaves the line as it is";
  EXPECT_TRUE(acknowledges(*line_of_message(payload, buffer), command));
  for (const DataLine& line :
       {encode_joint_positions({0.5, -0.65, 1.0}), encode_triple(TripleLine::kPosition, {1, -2, 3}),
        encode_strain_gauges({1, 2, 3, 4, 5, 6, 7, 8})}) {
    EXPECT_EQ(line_of_message(message_of_line(line.view()), buffer), line.view());
  }
  EXPECT_FALSE(line_of_message("neither ACK nor line", buffer));
  EXPECT_FALSE(line_of_message("", buffer));
  EXPECT_FALSE(line_of_message(std::string(kMaxLine + 1, '\n'), buffer));
}

}  // namespace
}  // namespace embody::mia
