#include "drivers/capture/can_listener.hpp"

#include <random>

#include "drivers/transport/can_double.hpp"
#include "tests/unit/capture/support.hpp"

namespace embody::capture {
namespace {

using transport::CanFrame;
using transport::CanId;

CanFrame random_frame(std::mt19937& random, CanId id) {
  CanFrame frame;
  frame.id = id;
  frame.size = static_cast<std::uint8_t>(random() % 9);
  for (std::size_t i = 0; i < frame.size; ++i) frame.data[i] = static_cast<std::uint8_t>(random());
  return frame;
}

TEST(CanListener, AFrameIsItsBytes) {
  std::mt19937 random(22);
  for (int i = 0; i < 1000; ++i) {
    const bool extended = random() % 2 == 0;
    const CanFrame frame =
        random_frame(random, {static_cast<std::uint32_t>(random()) & (extended ? 0x1fffffffu : 0x7ffu), extended});
    const auto again = frame_of(bytes_of(frame));
    ASSERT_TRUE(again.ok());
    EXPECT_EQ(again->id, frame.id);
    EXPECT_EQ(again->size, frame.size);
    EXPECT_EQ(again->data, frame.data);
  }
  EXPECT_FALSE(frame_of(test::Bytes(3)).ok());
  EXPECT_FALSE(frame_of(test::Bytes(13)).ok());
  EXPECT_FALSE(frame_of(test::bytes(std::string("\0\0\x08\0", 4))).ok());  // 0x800 has more than 11 bits
}

TEST(CanListener, RecordsFramesByWhoSentThemUntilTheBusIsGone) {
  auto pair = transport::double_pair();
  ASSERT_TRUE(pair.ok());
  const CanId host{0x340}, device{0x341};
  transport::CanBus far(std::move((*pair)[0]), "far", {});
  test::Recording recording(LinkKind::kCan);
  CanListener listener(*recording.writer);
  listener.start(transport::CanBus(std::move((*pair)[1]), "near", {host, device}), {host});
  std::mt19937 random(23);
  std::vector<CanFrame> sent;
  for (int i = 0; i < 40; ++i) {
    sent.push_back(random_frame(random, i % 3 == 0 ? host : device));
    ASSERT_EQ(far.send(sent.back()), IoStatus::kDone);
  }
  ASSERT_TRUE(test::eventually([&] { return recording.writer->counters().chunks == sent.size(); }));
  { const transport::CanBus gone = std::move(far); }
  ASSERT_TRUE(test::eventually([&] { return listener.over(); }));
  EXPECT_NE(listener.reason().find("has gone"), std::string_view::npos) << listener.reason();
  const Capture capture = recording.finish();
  ASSERT_EQ(capture.chunks.size(), sent.size() + 2);
  for (std::size_t i = 0; i < sent.size(); ++i) {
    EXPECT_EQ(capture.chunks[i + 1].event, sent[i].id == host ? Event::kOut : Event::kIn);
    EXPECT_EQ(capture.chunks[i + 1].bytes, bytes_of(sent[i]));
  }
}

}  // namespace
}  // namespace embody::capture
