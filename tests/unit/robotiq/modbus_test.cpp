#include "drivers/robotiq/modbus.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/robotiq/frames.hpp"

namespace embody::test {
namespace {

using modbus::Assembler;
using modbus::Function;
using modbus::Match;
using modbus::Reply;
using modbus::Request;

constexpr unsigned kSeed = 11;

Reply reply_of(const std::vector<std::uint16_t>& values) {
  Reply reply;
  reply.count = static_cast<std::uint16_t>(values.size());
  std::copy(values.begin(), values.end(), reply.values.begin());
  return reply;
}

Request random_request(std::mt19937& generator) {
  const std::array functions{Function::kReadHolding, Function::kReadInput, Function::kWriteSingle,
                             Function::kWriteMultiple, Function::kReadWriteMultiple};
  const auto word = [&generator] { return static_cast<std::uint16_t>(generator()); };
  Request request;
  request.slave = static_cast<std::uint8_t>(1 + generator() % 247);
  request.function = functions[generator() % functions.size()];
  const auto count = static_cast<std::uint16_t>(1 + generator() % modbus::kMaxRegisters);
  if (request.function != Function::kWriteSingle && request.function != Function::kWriteMultiple) {
    request.read_address = word();
    request.read_count = count;
  }
  if (request.function != Function::kReadHolding && request.function != Function::kReadInput) {
    request.write_address = word();
    request.write_count = request.function == Function::kWriteSingle ? std::uint16_t{1} : count;
    for (std::size_t i = 0; i < request.write_count; ++i) request.values[i] = word();
  }
  return request;
}

Reply random_reply(const Request& request, std::mt19937& generator) {
  Reply reply;
  if (generator() % 4 == 0) {
    reply.exception = static_cast<std::uint8_t>(1 + generator() % 255);
    return reply;
  }
  reply.count = request.read_count;
  for (std::size_t i = 0; i < reply.count; ++i) reply.values[i] = static_cast<std::uint16_t>(generator());
  return reply;
}

TEST(Modbus, WritesTheRequestsOfTheManualAndReadsThemBack) {
  for (const ManualRequest& printed : manual_requests()) {
    EXPECT_EQ(bytes_of(modbus::encode_request(printed.request)), bytes_of(printed.hex)) << printed.what;
    Request request;
    std::size_t size = 0;
    ASSERT_EQ(modbus::match_request(bytes_of(printed.hex), request, size), Match::kWhole) << printed.what;
    EXPECT_EQ(request, printed.request) << printed.what;
    EXPECT_EQ(size, bytes_of(printed.hex).size()) << printed.what;
  }
}

TEST(Modbus, ReadsTheRepliesOfTheManualAndWritesThem) {
  for (const ManualReply& printed : manual_replies()) {
    const auto bytes = bytes_of(printed.hex);
    Reply reply;
    std::size_t size = 0;
    ASSERT_EQ(modbus::match_reply(bytes, printed.request, reply, size), Match::kWhole) << printed.what;
    EXPECT_EQ(reply, reply_of(printed.values)) << printed.what;
    EXPECT_EQ(bytes_of(modbus::encode_reply(printed.request, reply)), bytes) << printed.what;
  }
}

TEST(Modbus, AReplyIsFoundAtEverySplitAndBehindRubbish) {
  for (const ManualReply& printed : manual_replies()) {
    const auto bytes = bytes_of(printed.hex);
    for (std::size_t split = 0; split <= bytes.size(); ++split) {
      Assembler incoming;
      incoming.push(bytes_of("09 03 FF 00 09 83"));  // beginnings that lead nowhere
      EXPECT_FALSE(incoming.take_reply(printed.request));
      incoming.push(std::span(bytes).first(split));
      const auto early = incoming.take_reply(printed.request);
      incoming.push(std::span(bytes).subspan(split));
      const auto reply = early ? early : incoming.take_reply(printed.request);
      ASSERT_TRUE(reply) << printed.what << ", split at " << split;
      EXPECT_EQ(*reply, reply_of(printed.values));
      EXPECT_EQ(early.has_value(), split == bytes.size());
      EXPECT_FALSE(incoming.take_reply(printed.request)) << "nothing is left";
    }
  }
}

TEST(Modbus, EveryRequestAndReplySurvivesTheWireByteByByte) {
  SCOPED_TRACE(kSeed);
  std::mt19937 generator(kSeed);
  for (int i = 0; i < 5'000; ++i) {
    const Request request = random_request(generator);
    const Reply reply = random_reply(request, generator);
    Assembler at_slave, at_host;
    std::optional<Request> received;
    for (const std::byte b : bytes_of(modbus::encode_request(request))) {
      ASSERT_FALSE(received);
      at_slave.push({&b, 1});
      received = at_slave.take_request();
    }
    ASSERT_EQ(received, request) << "request " << i;
    std::optional<Reply> answered;
    for (const std::byte b : bytes_of(modbus::encode_reply(request, reply))) {
      ASSERT_FALSE(answered);
      at_host.push({&b, 1});
      answered = at_host.take_reply(request);
    }
    ASSERT_EQ(answered, reply) << "reply " << i;
  }
}

TEST(Modbus, AnyWrongByteMakesAReplyUnreadable) {
  for (const ManualReply& printed : manual_replies()) {
    for (std::size_t i = 0; i < bytes_of(printed.hex).size(); ++i) {
      for (unsigned flip = 1; flip < 256; ++flip) {
        auto bytes = bytes_of(printed.hex);
        bytes[i] ^= static_cast<std::byte>(flip);
        Reply reply;
        std::size_t size = 0;
        ASSERT_NE(modbus::match_reply(bytes, printed.request, reply, size), Match::kWhole)
            << printed.what << ", byte " << i << " flipped by " << flip;
      }
    }
  }
}

TEST(Modbus, RepliesToOtherRequestsAndOfOtherSlavesAreNotTaken) {
  const Request request = read_of(Function::kReadHolding, 3);
  const Reply reply = reply_of({1, 2, 3});
  const auto taken = [&request](const modbus::Frame& frame) {
    Assembler incoming;
    incoming.push(frame.view());
    return incoming.take_reply(request).has_value();
  };
  EXPECT_TRUE(taken(modbus::encode_reply(request, reply)));
  Request other = request;
  other.slave = 8;
  EXPECT_FALSE(taken(modbus::encode_reply(other, reply)));
  other = request;
  other.read_count = 2;
  EXPECT_FALSE(taken(modbus::encode_reply(other, reply)));
  EXPECT_FALSE(taken(modbus::encode_reply(read_of(Function::kReadInput, 3), reply)));
  EXPECT_FALSE(taken(modbus::encode_request(request))) << "an adapter that echoes";
  EXPECT_FALSE(taken(modbus::encode_request(write_of({true, true, 3, 9, 9}))));
}

TEST(Modbus, AReplyIsFoundBehindTheEchoOfItsRequest) {
  for (const ManualReply& printed : manual_replies()) {
    Assembler incoming;
    incoming.push(modbus::encode_request(printed.request).view());
    incoming.push(bytes_of(printed.hex));
    const auto reply = incoming.take_reply(printed.request);
    ASSERT_TRUE(reply) << printed.what;
    EXPECT_EQ(*reply, reply_of(printed.values)) << printed.what;
  }
}

TEST(Modbus, AnEndlessStreamOfRubbishStaysWithinTheBuffer) {
  std::mt19937 generator(kSeed);
  Assembler incoming;
  const Request request = read_of(Function::kReadHolding, 3);
  for (int i = 0; i < 10'000; ++i) {
    const auto b = static_cast<std::byte>(generator());
    incoming.push({&b, 1});
    if (i % 500 == 0) static_cast<void>(incoming.take_reply(request));
  }
  EXPECT_GT(incoming.skipped_bytes(), 9'000u);
  incoming.push(bytes_of("09 03 06 39 00 00 FF 0E 0A F7 8B"));
  EXPECT_TRUE(incoming.take_reply(request));
}

}  // namespace
}  // namespace embody::test
