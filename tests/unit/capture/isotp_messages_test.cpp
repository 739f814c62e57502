#include "drivers/capture/isotp_messages.hpp"

#include <random>

#include "drivers/capture/can_listener.hpp"
#include "tests/unit/capture/isotp_frames.hpp"
#include "tests/unit/capture/support.hpp"

namespace embody::capture {
namespace {

using transport::CanId;

Chunk frame(Event event, CanId id, const test::Bytes& data) {
  Chunk chunk;
  chunk.event = event;
  chunk.bytes = bytes_of({id, 0, {}, {}});
  chunk.bytes.insert(chunk.bytes.end(), data.begin(), data.end());
  return chunk;
}

test::Bytes of(std::initializer_list<unsigned> values) {
  test::Bytes bytes;
  for (const unsigned value : values) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

Capture can(std::vector<Chunk> chunks) {
  Capture capture{{}, std::move(chunks)};
  capture.header.link = LinkKind::kCan;
  return capture;
}

TEST(IsoTpMessages, AnySizeComesThroughAndTwoDirectionsDoNotMix) {
  constexpr CanId kHost{0x340}, kHand{0x18DAF110, true};
  std::mt19937 random(24);
  for (std::size_t size = 1; size <= 130; ++size) {
    for (const bool padded : {false, true}) {
      test::Bytes question(size), answer(131 - size);
      for (auto* side : {&question, &answer}) {
        for (auto& byte : *side) byte = static_cast<std::byte>(random());
      }
      std::vector<Chunk> up, down, mixed;
      for (const auto& data : test::isotp_frames(question, padded)) up.push_back(frame(Event::kOut, kHost, data));
      for (const auto& data : test::isotp_frames(answer, padded)) down.push_back(frame(Event::kIn, kHand, data));
      for (std::size_t i = 0; i < std::max(up.size(), down.size()); ++i) {
        if (i < up.size()) mixed.push_back(up[i]);
        if (i == 0) mixed.push_back(frame(Event::kIn, kHand, of({0x30, 0, 0})));  // flow control
        if (i < down.size()) mixed.push_back(down[i]);
      }
      const auto joined = join_isotp(can(mixed));
      ASSERT_TRUE(joined.ok()) << joined.error().detail.view();
      ASSERT_EQ(joined->chunks.size(), 2u) << size;
      for (const Chunk& chunk : joined->chunks) {
        EXPECT_EQ(chunk.bytes, chunk.event == Event::kOut ? frame(Event::kOut, kHost, question).bytes
                                                          : frame(Event::kIn, kHand, answer).bytes);
      }
    }
  }
}

TEST(IsoTpMessages, WhatIsNoMessageIsLeftOutOrSaysWhere) {
  constexpr CanId kId{0x341};
  const auto alone = [&](const test::Bytes& data) { return join_isotp(can({frame(Event::kIn, kId, data)})); };
  for (const auto& harmless : {of({0x21, 1, 2}), of({0x10, 9, 1, 2, 3, 4, 5, 6}), of({0x30, 0, 0})}) {
    const auto joined = alone(harmless);  // its beginning or its end is not in the capture, or flow control
    ASSERT_TRUE(joined.ok());
    EXPECT_TRUE(joined->chunks.empty());
  }
  for (const auto& wrong :
       {of({}), of({0x00, 1}), of({0x05, 1, 2}), of({0x40, 1}), of({0x10, 7, 1, 2, 3, 4, 5, 6}), of({0x10, 20, 1})}) {
    const auto joined = alone(wrong);
    ASSERT_FALSE(joined.ok());
    EXPECT_NE(joined.error().detail.view().find("chunk 1: "), std::string_view::npos);
  }
  const Chunk first = frame(Event::kIn, kId, of({0x10, 20, 1, 2, 3, 4, 5, 6}));
  const auto skipped = join_isotp(can({first, frame(Event::kIn, kId, of({0x22, 1, 2, 3, 4, 5, 6, 7}))}));
  ASSERT_FALSE(skipped.ok());
  EXPECT_NE(skipped.error().detail.view().find("chunk 2: consecutive frame 2 comes where 1"), std::string_view::npos);
  EXPECT_FALSE(join_isotp(can({first, frame(Event::kIn, kId, of({0x21, 1}))})).ok());
  EXPECT_EQ(join_isotp(Capture{}).error().code, Errc::kInvalidArgument);  // QTM
}

}  // namespace
}  // namespace embody::capture
