#include "drivers/landmarks/codec.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "core/hand/landmark_layout.hpp"

namespace embody::landmarks {
namespace {

static_assert(kLandmarkCount == hand::kLandmarks, "the driver fills the slots of the layout");
static_assert(std::endian::native == std::endian::little, "the tests write numbers as they lie in memory");

using Bytes = std::array<std::byte, kDatagramSize>;

/// Random numbers by bits, so that the sequence is the same everywhere.
class RandomFrames {
 public:
  explicit RandomFrames(std::uint64_t seed) : engine_(seed) {}
  LandmarkFrame operator()() {
    LandmarkFrame frame;
    frame.side = engine_() % 2 == 0 ? Side::kRight : Side::kLeft;
    frame.frame_number = engine_();
    frame.t_capture_ns = static_cast<std::int64_t>(engine_() >> 1);
    for (auto& landmark : frame.landmarks) {
      for (float& x : landmark.p_W) x = 20.0F * unit() - 10.0F;
      landmark.confidence = unit();
    }
    return frame;
  }

 private:
  float unit() { return static_cast<float>(engine_() >> 40) * 0x1p-24F; }
  std::mt19937_64 engine_;
};

template <class T>
Bytes with(Bytes bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
  return bytes;
}

Bytes valid() {
  LandmarkFrame frame;
  frame.frame_number = 7;
  return encode(frame);
}

bool refused(std::span<const std::byte> bytes, Errc code = Errc::kMalformed) {
  const auto decoded = decode(bytes);
  return !decoded && decoded.error().code == code && !decoded.error().detail.empty();
}

TEST(LandmarkCodec, DecodesWhatItEncodesBitByBit) {
  RandomFrames random(1);
  for (int i = 0; i < 1000; ++i) {
    const LandmarkFrame frame = random();
    const auto decoded = decode(encode(frame));
    ASSERT_TRUE(decoded.ok()) << i << ": " << decoded.error().detail.view();
    ASSERT_EQ(decoded->side, frame.side);
    ASSERT_EQ(decoded->frame_number, frame.frame_number);
    ASSERT_EQ(decoded->t_capture_ns, frame.t_capture_ns);
    for (std::size_t k = 0; k < kLandmarkCount; ++k) {
      ASSERT_EQ(decoded->landmarks[k].p_W, frame.landmarks[k].p_W);
      ASSERT_EQ(decoded->landmarks[k].confidence, frame.landmarks[k].confidence);
    }
  }
}

TEST(LandmarkCodec, PutsEveryNumberWhereTheDocumentationSays) {
  LandmarkFrame frame;
  frame.side = Side::kLeft;
  frame.frame_number = 0x0102030405060708;
  frame.t_capture_ns = 0x1112131415161718;
  frame.landmarks[20] = {{1.0F, -2.0F, 0.5F}, 0.25F};
  const Bytes bytes = encode(frame);
  ASSERT_EQ(bytes.size(), 360U);
  EXPECT_EQ(std::memcmp(bytes.data(),
                        "EMLM\x01\x00\x01\x00\x08\x07\x06\x05\x04\x03\x02\x01"
                        "\x18\x17\x16\x15\x14\x13\x12\x11",
                        24),
            0);
  EXPECT_EQ(std::memcmp(bytes.data() + 344, "\x00\x00\x80\x3f\x00\x00\x00\xc0\x00\x00\x00\x3f\x00\x00\x80\x3e", 16), 0);
}

TEST(LandmarkCodec, RefusesEveryOtherSize) {
  const Bytes bytes = valid();
  std::vector<std::byte> longer(bytes.begin(), bytes.end());
  longer.resize(kDatagramSize + 1);
  for (std::size_t size = 0; size <= longer.size(); ++size) {
    EXPECT_EQ(refused(std::span(longer).first(size)), size != kDatagramSize) << size;
  }
}

TEST(LandmarkCodec, RefusesAnotherHeader) {
  const Bytes bytes = valid();
  ASSERT_TRUE(decode(bytes).ok());
  for (std::size_t i = 0; i < 4; ++i) EXPECT_TRUE(refused(with(bytes, i, 'x'))) << i;
  for (const int version : {0, 2, 256, 65535}) {
    EXPECT_TRUE(refused(with(bytes, 4, static_cast<std::uint16_t>(version)), Errc::kUnsupported)) << version;
  }
  EXPECT_TRUE(refused(with(bytes, 6, std::uint8_t{2})));
  EXPECT_TRUE(refused(with(bytes, 7, std::uint8_t{1})));
  EXPECT_TRUE(refused(with(bytes, 16, std::int64_t{-1})));
}

TEST(LandmarkCodec, RefusesNumbersOutOfRangeInAnyPlace) {
  const Bytes bytes = valid();
  const float infinite = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t i = 0; i < kLandmarkCount; ++i) {
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t at = kHeaderSize + 16 * i + 4 * k;
      for (const float bad : {nan, -nan, infinite, -infinite, 10.001F, -10.001F}) {
        EXPECT_TRUE(refused(with(bytes, at, bad))) << bad << " at " << at;
      }
      const float most = k < 3 ? 10.0F : 1.0F;
      EXPECT_TRUE(decode(with(bytes, at, most)).ok()) << at;
      EXPECT_EQ(refused(with(bytes, at, -0.01F)), k == 3) << at;
    }
  }
}

TEST(LandmarkCodec, NeverAcceptsRandomBytesAfterAGoodHeaderUnlessTheyAreInRange) {
  std::mt19937_64 engine(2);
  for (int i = 0; i < 2000; ++i) {
    Bytes bytes = valid();
    for (std::size_t at = kHeaderSize; at < kDatagramSize; ++at) bytes[at] = static_cast<std::byte>(engine());
    const auto decoded = decode(bytes);
    if (!decoded) continue;
    for (const auto& landmark : decoded->landmarks) {
      for (const float x : landmark.p_W) ASSERT_LE(std::abs(x), kFarthestMetres);
    }
  }
}

}  // namespace
}  // namespace embody::landmarks
