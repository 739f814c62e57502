#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "drivers/qualisys/codec.hpp"
#include "drivers/qualisys/stream_reassembler.hpp"

namespace embody::qualisys {
namespace {

using Bytes = std::vector<std::byte>;

std::vector<Bytes> typical_packets() {
  DataPacket data;
  for (int i = 0; i < 5; ++i) data.markers.push_back({{0.1 * i, 0.2, 0.3}, true});
  constexpr Component kComponents[] = {Component::k3d};
  return {encode_text(PacketType::kCommand, "QTM RT Interface connected"), encode_no_more_data(),
          encode_data(data, kComponents), encode_event(Event::kCaptureStarted), encode_data(data, kComponents)};
}

Bytes concatenate(const std::vector<Bytes>& packets) {
  Bytes stream;
  for (const auto& packet : packets) stream.insert(stream.end(), packet.begin(), packet.end());
  return stream;
}

/// Feeds `bytes` as far as the buffer allows at a time; appends the packets that come out.
void feed(StreamReassembler& reassembler, std::span<const std::byte> bytes, std::vector<Bytes>& out) {
  while (!bytes.empty()) {
    const auto space = reassembler.free_space();
    const std::size_t size = std::min(space.size(), bytes.size());
    ASSERT_GT(size, 0U);
    std::copy_n(bytes.begin(), size, space.begin());
    reassembler.commit(size);
    bytes = bytes.subspan(size);
    for (auto packet = reassembler.next();; packet = reassembler.next()) {
      ASSERT_TRUE(packet.ok());
      if (packet->empty()) break;
      out.emplace_back(packet->begin(), packet->end());
    }
  }
}

TEST(StreamReassembler, YieldsTheSamePacketsWhereverTheStreamIsSplit) {
  const auto packets = typical_packets();
  const auto stream = concatenate(packets);
  for (std::size_t split = 0; split <= stream.size(); ++split) {
    StreamReassembler reassembler(256);
    std::vector<Bytes> out;
    feed(reassembler, std::span(stream).first(split), out);
    feed(reassembler, std::span(stream).subspan(split), out);
    ASSERT_EQ(out, packets) << "split behind byte " << split;
  }
}

TEST(StreamReassembler, YieldsTheSamePacketsByteByByte) {
  const auto packets = typical_packets();
  StreamReassembler reassembler(256);
  std::vector<Bytes> out;
  const auto stream = concatenate(packets);
  for (const auto& byte : stream) feed(reassembler, {&byte, 1}, out);
  EXPECT_EQ(out, packets);
}

TEST(StreamReassembler, YieldsTheSamePacketsForRandomChunksThroughASmallBuffer) {
  std::mt19937 random(/*seed=*/11);
  std::vector<Bytes> packets;
  for (int i = 0; i < 200; ++i) {
    const auto more = typical_packets();
    packets.insert(packets.end(), more.begin(), more.end());
  }
  const auto stream = concatenate(packets);
  StreamReassembler reassembler(101);  // the largest packet has 100 bytes
  std::vector<Bytes> out;
  for (std::size_t begin = 0; begin < stream.size();) {
    const std::size_t size = std::min<std::size_t>(1 + random() % 150, stream.size() - begin);
    feed(reassembler, std::span(stream).subspan(begin, size), out);
    begin += size;
  }
  EXPECT_EQ(out, packets);
}

TEST(StreamReassembler, PassesAPacketOfItsCapacityAndRefusesALargerOne) {
  const auto packet = encode_text(PacketType::kXml, std::string(91, 'x'));
  ASSERT_EQ(packet.size(), 100U);
  StreamReassembler enough(100);
  std::vector<Bytes> out;
  feed(enough, packet, out);
  ASSERT_EQ(out.size(), 1U);

  StreamReassembler small(99);
  std::copy_n(packet.begin(), 99, small.free_space().begin());
  small.commit(99);
  const auto next = small.next();
  ASSERT_FALSE(next.ok());
  EXPECT_EQ(next.error().code, Errc::kUnsupported);
}

TEST(StreamReassembler, RefusesASizeThatNoPacketHas) {
  StreamReassembler reassembler(64);
  std::fill_n(reassembler.free_space().begin(), kHeaderSize, std::byte{0});
  reassembler.commit(kHeaderSize);
  const auto next = reassembler.next();
  ASSERT_FALSE(next.ok());
  EXPECT_EQ(next.error().code, Errc::kMalformed);
}

}  // namespace
}  // namespace embody::qualisys
