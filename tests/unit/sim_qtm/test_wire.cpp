#include <gtest/gtest.h>

#include <random>

#include "drivers/sim/qtm/wire.hpp"
#include "tests/unit/sim_qtm/support.hpp"

namespace embody::sim {
namespace {

std::string hex(const Bytes& bytes) {
  std::string text;
  for (const std::byte b : bytes) {
    constexpr const char* kDigits = "0123456789abcdef";
    text += kDigits[std::to_integer<int>(b) >> 4];
    text += kDigits[std::to_integer<int>(b) & 15];
  }
  return text;
}

TEST(QtmWire, WritesStringsEventsAndNoMoreDataInBothByteOrders) {
  EXPECT_EQ(hex(string_packet(Packet::kCommand, "Ab", ByteOrder::kLittle)), "0b00000001000000416200");
  EXPECT_EQ(hex(string_packet(Packet::kError, "Ab", ByteOrder::kBig)), "0000000b00000000416200");
  EXPECT_EQ(hex(event_packet(QtmEvent::kCaptureStarted, ByteOrder::kLittle)), "090000000600000003");
  EXPECT_EQ(hex(event_packet(QtmEvent::kTrigger, ByteOrder::kBig)), "000000090000000610");
  EXPECT_EQ(hex(no_more_data_packet(ByteOrder::kLittle)), "0800000004000000");
  EXPECT_EQ(string_packet(Packet::kCommand, "QTM RT Interface connected", ByteOrder::kLittle).size(), 35U);
}

TEST(QtmWire, GetStateNeverTellsEventsThatOnlyHappen) {
  for (const int id : {11, 12, 13, 16}) EXPECT_FALSE(tells_state(static_cast<QtmEvent>(id))) << id;
  for (const int id : {1, 2, 3, 4, 6, 7, 8, 9, 10, 14, 15}) EXPECT_TRUE(tells_state(static_cast<QtmEvent>(id))) << id;
}

/// Requests of any type and length, with and without a terminating NUL.
std::vector<std::pair<std::uint32_t, std::string>> requests() {
  return {{1, "Version 1.25"}, {1, ""}, {2, "<QTM_Settings></QTM_Settings>"}, {1, std::string(300, 'x')}, {7, "?"}};
}
Bytes stream_of_requests(ByteOrder order) {
  Bytes stream;
  bool terminated = false;
  for (const auto& [type, text] : requests()) {
    terminated = !terminated;
    Writer out(stream, order);
    out.u32(static_cast<std::uint32_t>(8 + text.size() + (terminated ? 1 : 0)));
    out.u32(type);
    for (const char c : text) out.u8(static_cast<std::uint8_t>(c));
    if (terminated) out.u8(0);
  }
  return stream;
}

TEST(RequestReader, FindsTheSameRequestsWhereverTheStreamIsSplit) {
  for (const ByteOrder order : {ByteOrder::kLittle, ByteOrder::kBig}) {
    const Bytes stream = stream_of_requests(order);
    for (std::size_t split = 0; split <= stream.size(); ++split) {
      RequestReader reader(order);
      std::vector<std::pair<std::uint32_t, std::string>> found;
      for (const auto& part : {std::span(stream).first(split), std::span(stream).subspan(split)}) {
        reader.push(part);
        for (auto next = reader.next(); next && *next; next = reader.next()) {
          found.emplace_back((*next)->type, (*next)->text);
        }
      }
      ASSERT_EQ(found, requests()) << "split at " << split;
    }
  }
}

TEST(RequestReader, RefusesImpossibleSizes) {
  for (const std::uint32_t size : {0U, 7U, 65'537U, 0xFFFFFFFFU}) {
    Bytes bytes;
    Writer(bytes, ByteOrder::kLittle).header(size, Packet::kCommand);
    RequestReader reader(ByteOrder::kLittle);
    reader.push(bytes);
    EXPECT_EQ(reader.next().error().code, Errc::kMalformed) << size;
  }
}

TEST(Discovery, TakesTheRequestOfTheDocumentAndNothingElse) {
  const Bytes request{std::byte{10}, {}, {}, {}, std::byte{7}, {}, {}, {}, std::byte{0x11}, std::byte{0xb6}};
  EXPECT_EQ(discovery_reply_port(request), 4534);
  for (std::size_t i = 0; i < 8; ++i) {
    Bytes wrong = request;
    wrong[i] ^= std::byte{1};
    EXPECT_FALSE(discovery_reply_port(wrong)) << i;
  }
  for (std::size_t size = 0; size < request.size(); ++size) {
    EXPECT_FALSE(discovery_reply_port(std::span(request).first(size)));
  }
  Bytes no_port = request;
  no_port[8] = no_port[9] = std::byte{0};
  EXPECT_FALSE(discovery_reply_port(no_port));
}

TEST(Discovery, RepliesWithAnExactSizeAndTheBasePortInBigEndian) {
  const Bytes reply = discovery_reply("HOST, QTM 2023.3", 22222);
  EXPECT_EQ(hex(reply), "1b00000001000000484f53542c2051544d20323032332e330056ce");
}

}  // namespace
}  // namespace embody::sim
