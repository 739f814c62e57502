#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <random>

#include "drivers/qualisys/codec.hpp"

namespace embody::qualisys {
namespace {

using Bytes = std::vector<std::byte>;

constexpr Component kOnly3d[] = {Component::k3d};
constexpr Component kBoth[] = {Component::k3dResidual, Component::k3d};

/// The example of the protocol documentation: two markers, the second one missing.
Bytes documented_packet() {
  const std::initializer_list<unsigned> values = {
      0x40, 0,    0,    0,    3,    0,    0,    0,    0x10, 0x27, 0,    0,    0,    0,    0,    0,
      2,    0,    0,    0,    1,    0,    0,    0,                                                  // frame header
      0x28, 0,    0,    0,    1,    0,    0,    0,    2,    0,    0,    0,    0,    0,    0,    0,  // component header
      0,    0,    0x80, 0x3f, 0,    0,    0,    0x40, 0,    0,    0x40, 0x40, 0xff, 0xff, 0xff, 0xff,
      0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff};
  Bytes bytes;
  for (const unsigned value : values) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

void store_u32(Bytes& bytes, std::size_t offset, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) bytes[offset + i] = static_cast<std::byte>((value >> (8 * i)) & 0xFF);
}

DataPacket random_packet(std::mt19937& random, std::size_t count) {
  std::uniform_real_distribution<double> position_m(-5.0, 5.0);
  std::bernoulli_distribution visible(0.8);
  DataPacket packet;
  packet.timestamp_us = random();
  packet.frame_number = static_cast<std::uint32_t>(random());
  packet.drop_rate_permille = static_cast<std::uint16_t>(random() % 1001);
  packet.out_of_sync_permille = static_cast<std::uint16_t>(random() % 1001);
  for (std::size_t i = 0; i < count; ++i) {
    packet.markers.push_back({{position_m(random), position_m(random), position_m(random)}, visible(random)});
  }
  return packet;
}

TEST(QualisysCodec, ReadsTheDocumentedExample) {
  DataPacket data;
  ASSERT_TRUE(decode_data(documented_packet(), data).ok());
  EXPECT_EQ(data.timestamp_us, 10000U);
  EXPECT_EQ(data.frame_number, 2U);
  ASSERT_EQ(data.markers.size(), 2U);
  EXPECT_TRUE(data.markers[0].visible);
  EXPECT_TRUE(data.markers[0].p_W.isApprox(Eigen::Vector3d(0.001, 0.002, 0.003), 1e-12));
  EXPECT_FALSE(data.markers[1].visible);
}

TEST(QualisysCodec, WritesTheDocumentedExample) {
  DataPacket data;
  data.timestamp_us = 10000;
  data.frame_number = 2;
  data.markers.push_back({{0.001, 0.002, 0.003}, true});
  data.markers.push_back({});
  EXPECT_EQ(encode_data(data, kOnly3d), documented_packet());
}

TEST(QualisysCodec, ReadsBackWhatItWritesForAnyNumberOfMarkers) {
  std::mt19937 random(/*seed=*/42);
  for (std::size_t count = 0; count <= kMaxDataMarkers; ++count) {
    const DataPacket sent = random_packet(random, count);
    DataPacket received;
    ASSERT_TRUE(decode_data(encode_data(sent, kBoth), received).ok()) << count;
    ASSERT_EQ(received.markers.size(), count);
    EXPECT_EQ(received.timestamp_us, sent.timestamp_us);
    EXPECT_EQ(received.frame_number, sent.frame_number);
    EXPECT_EQ(received.drop_rate_permille, sent.drop_rate_permille);
    EXPECT_EQ(received.out_of_sync_permille, sent.out_of_sync_permille);
    for (std::size_t i = 0; i < count; ++i) {
      ASSERT_EQ(received.markers[i].visible, sent.markers[i].visible);
      if (!sent.markers[i].visible) continue;
      ASSERT_LE((received.markers[i].p_W - sent.markers[i].p_W).norm(), 1e-6) << "float resolution at 5 m";
    }
  }
}

TEST(QualisysCodec, TakesAMarkerWithAnyCoordinateThatIsNotFiniteAsMissing) {
  for (const float value : {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::quiet_NaN(),
                            std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()}) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      auto bytes = documented_packet();
      std::memcpy(bytes.data() + 40 + 4 * axis, &value, sizeof value);
      DataPacket data;
      ASSERT_TRUE(decode_data(bytes, data).ok());
      EXPECT_FALSE(data.markers[0].visible) << value << " on axis " << axis;
    }
  }
}

TEST(QualisysCodec, SkipsComponentsThatItDoesNotKnow) {
  auto bytes = documented_packet();
  Bytes timecode(24, std::byte{0x5A});
  store_u32(timecode, 0, 24);
  store_u32(timecode, 4, 17);
  bytes.insert(bytes.begin() + 24, timecode.begin(), timecode.end());
  store_u32(bytes, 0, static_cast<std::uint32_t>(bytes.size()));
  store_u32(bytes, 20, 2);
  DataPacket data;
  ASSERT_TRUE(decode_data(bytes, data).ok());
  EXPECT_TRUE(data.has_markers);
  ASSERT_EQ(data.markers.size(), 2U);
  EXPECT_NEAR(data.markers[0].p_W.x(), 0.001, 1e-12);
}

TEST(QualisysCodec, ReportsNoMarkersWhenNo3dComponentIsPresent) {
  auto bytes = documented_packet();
  store_u32(bytes, 28, 17);  // a time code of the same size
  DataPacket data;
  data.has_markers = true;
  ASSERT_TRUE(decode_data(bytes, data).ok());
  EXPECT_FALSE(data.has_markers);
  EXPECT_TRUE(data.markers.empty());
}

TEST(QualisysCodec, RefusesEveryTruncationOfAPacket) {
  const auto whole = documented_packet();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    DataPacket data;
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_FALSE(decode_data(cut, data).ok()) << "length field still says 64, " << size << " bytes";
    auto consistent = cut;
    if (size >= kHeaderSize) store_u32(consistent, 0, static_cast<std::uint32_t>(size));
    EXPECT_FALSE(decode_data(consistent, data).ok()) << "length field says " << size;
  }
}

TEST(QualisysCodec, RefusesFieldsThatContradictEachOther) {
  struct Lie {
    const char* what;
    std::size_t offset;
    std::uint32_t value;
  };
  for (const auto& lie :
       {Lie{"packet size", 0, 63}, Lie{"packet size", 0, 65}, Lie{"packet type", 4, 1},
        Lie{"time stamp", 12, 0x7fffffff}, Lie{"component count", 20, 0}, Lie{"component count", 20, 2},
        Lie{"component count", 20, 0xffffffff}, Lie{"component size", 24, 0}, Lie{"component size", 24, 7},
        Lie{"component size", 24, 15}, Lie{"component size", 24, 39}, Lie{"component size", 24, 41},
        Lie{"component size", 24, 0xffffffff}, Lie{"marker count", 32, 1}, Lie{"marker count", 32, 3},
        Lie{"marker count", 32, 0xffffffff}}) {
    auto bytes = documented_packet();
    store_u32(bytes, lie.offset, lie.value);
    DataPacket data;
    EXPECT_FALSE(decode_data(bytes, data).ok()) << lie.what << ' ' << lie.value;
  }
}

TEST(QualisysCodec, RefusesMoreMarkersThanItsCapacity) {
  Bytes bytes(24 + 16 + 12 * (kMaxDataMarkers + 1));
  store_u32(bytes, 0, static_cast<std::uint32_t>(bytes.size()));
  store_u32(bytes, 4, 3);
  store_u32(bytes, 20, 1);
  store_u32(bytes, 24, static_cast<std::uint32_t>(bytes.size() - 24));
  store_u32(bytes, 28, 1);
  store_u32(bytes, 32, kMaxDataMarkers + 1);
  DataPacket data;
  const auto status = decode_data(bytes, data);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, Errc::kUnsupported);
}

TEST(QualisysCodec, SurvivesRandomDamage) {
  std::mt19937 random(/*seed=*/7);
  const auto sound = encode_data(random_packet(random, 13), kBoth);
  std::size_t refused = 0;
  for (int i = 0; i < 20'000; ++i) {
    auto bytes = sound;
    for (int changes = 0; changes < 3; ++changes) bytes[random() % bytes.size()] = static_cast<std::byte>(random());
    DataPacket data;
    if (!decode_data(bytes, data).ok()) ++refused;
    ASSERT_LE(data.markers.size(), kMaxDataMarkers);
    for (const auto& marker : data.markers) ASSERT_TRUE(!marker.visible || marker.p_W.allFinite());
  }
  EXPECT_GT(refused, 0U);
}

TEST(QualisysCodec, BoundsThePacketSize) {
  Bytes bytes(kHeaderSize);
  for (const std::uint32_t size : {0U, 7U, static_cast<std::uint32_t>(kMaxPacketSize) + 1, 0xffffffffU}) {
    store_u32(bytes, 0, size);
    const auto header = decode_header(bytes);
    ASSERT_FALSE(header.ok()) << size;
    EXPECT_EQ(header.error().code, Errc::kMalformed);
  }
  for (const std::uint32_t size : {8U, static_cast<std::uint32_t>(kMaxPacketSize)}) {
    store_u32(bytes, 0, size);
    EXPECT_TRUE(decode_header(bytes).ok()) << size;
  }
}

TEST(QualisysCodec, ReadsTextWithAndWithoutItsTerminator) {
  auto bytes = encode_text(PacketType::kCommand, "Version 1.25");
  EXPECT_EQ(bytes.size(), 21U);
  EXPECT_EQ(*decode_text(bytes), "Version 1.25");
  bytes.pop_back();
  store_u32(bytes, 0, static_cast<std::uint32_t>(bytes.size()));
  EXPECT_EQ(*decode_text(bytes), "Version 1.25");
  EXPECT_EQ(*decode_text(encode_text(PacketType::kError, "")), "");
  EXPECT_FALSE(decode_text(encode_event(Event::kConnected)).ok());
}

TEST(QualisysCodec, ReadsEventsAndRefusesOtherSizes) {
  auto bytes = encode_event(Event::kPlaybackStarted);
  EXPECT_EQ(bytes.size(), 9U);
  EXPECT_EQ(*decode_event(bytes), Event::kPlaybackStarted);
  bytes.push_back(std::byte{0});
  store_u32(bytes, 0, 10);
  EXPECT_FALSE(decode_event(bytes).ok());
  EXPECT_FALSE(decode_event(encode_no_more_data()).ok());
}

}  // namespace
}  // namespace embody::qualisys
