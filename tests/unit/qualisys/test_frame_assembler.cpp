#include <gtest/gtest.h>

#include <algorithm>

#include "drivers/qualisys/frame_assembler.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::qualisys {
namespace {

using std::chrono::microseconds;

constexpr bool kBodies = true, kMarkersOnly = false, kInOrder = true, kAnyOrder = false;
constexpr std::uint64_t kPeriodUs = 10'000;

/// A packet with the time stamp of frame k; the number of its items says which frame it belongs to.
DataPacket packet(std::uint64_t k, bool markers, bool bodies) {
  DataPacket data;
  data.timestamp_us = k * kPeriodUs;
  data.frame_number = 1;  // stands still, as in QTM's preview
  data.has_markers = markers;
  data.has_bodies = bodies;
  data.markers.resize(markers ? k % 200 + 1 : 0);
  data.bodies.resize(bodies ? k % 50 + 1 : 0);
  return data;
}

TimePoint at(std::uint64_t k) {
  return TimePoint{std::chrono::hours(1) + microseconds(k * kPeriodUs)};
}

TEST(FrameAssembler, PassesWholeFramesThough) {
  FrameAssembler assembler(kMarkersOnly, kInOrder);
  for (std::uint64_t k = 0; k < 100; ++k) {
    const auto data = packet(k, true, false);
    ASSERT_EQ(assembler.step(data, at(k)), Assembly::kWhole);
    EXPECT_EQ(&assembler.frame(), &data) << "nothing is copied";
  }
  EXPECT_EQ(assembler.useless() + assembler.incomplete() + assembler.restarts(), 0U);
}

TEST(FrameAssembler, MergesTheComponentsOfOneFrameWhicheverComesFirst) {
  FrameAssembler assembler(kBodies, kAnyOrder);
  for (std::uint64_t k = 0; k < 100; ++k) {
    const bool markers_first = k % 2 == 0;
    ASSERT_EQ(assembler.step(packet(k, markers_first, !markers_first), at(k)), Assembly::kPart);
    ASSERT_EQ(assembler.step(packet(k, !markers_first, markers_first), at(k)), Assembly::kWhole);
    EXPECT_EQ(assembler.frame().timestamp_us, k * kPeriodUs);
    EXPECT_EQ(assembler.frame().markers.size(), k + 1);
    EXPECT_EQ(assembler.frame().bodies.size(), k % 50 + 1);
  }
  EXPECT_EQ(assembler.incomplete(), 0U);
}

TEST(FrameAssembler, GivesUpAFrameOfWhichAComponentNeverCame) {
  FrameAssembler assembler(kBodies, kAnyOrder);
  ASSERT_EQ(assembler.step(packet(1, true, false), at(1)), Assembly::kPart);
  ASSERT_EQ(assembler.step(packet(2, true, true), at(2)), Assembly::kWhole);
  EXPECT_EQ(assembler.frame().markers.size(), 3U);
  EXPECT_EQ(assembler.incomplete(), 1U);
  EXPECT_EQ(assembler.step(packet(1, false, true), at(2)), Assembly::kUseless) << "too late";
}

TEST(FrameAssembler, LetsEachFrameThroughOnceAndNeverGoesBackHoweverDatagramsAreShuffled) {
  test::RandomValues random(/*seed=*/5);
  for (int round = 0; round < 200; ++round) {
    std::vector<DataPacket> packets;
    for (std::uint64_t k = 1; k <= 40; ++k) {
      packets.push_back(packet(k, true, false));
      packets.push_back(packet(k, false, true));
      if (random(0.0, 1.0) < 0.2) packets.push_back(packets.back());
    }
    for (std::size_t i = 0; i + 1 < packets.size(); ++i) {
      if (random(0.0, 1.0) < 0.2) std::swap(packets[i], packets[i + 1]);
    }
    FrameAssembler assembler(kBodies, kAnyOrder);
    std::uint64_t last = 0, whole = 0;
    for (const auto& data : packets) {
      if (assembler.step(data, at(data.timestamp_us / kPeriodUs)) != Assembly::kWhole) continue;
      const auto& frame = assembler.frame();
      ASSERT_GT(frame.timestamp_us, last);
      const std::uint64_t k = frame.timestamp_us / kPeriodUs;
      ASSERT_EQ(frame.markers.size(), k % 200 + 1) << "markers of another frame";
      ASSERT_EQ(frame.bodies.size(), k % 50 + 1) << "bodies of another frame";
      last = frame.timestamp_us;
      ++whole;
    }
    ASSERT_GE(whole + assembler.incomplete() + 1, 40U);
    ASSERT_EQ(assembler.restarts(), 0U);
  }
}

TEST(FrameAssembler, SeesAClockThatStartsAnewAtOnceWhereTheOrderIsKept) {
  for (const std::uint64_t back : {1U, 3U, 900U}) {
    FrameAssembler assembler(kMarkersOnly, kInOrder);
    ASSERT_EQ(assembler.step(packet(1000, true, false), at(1000)), Assembly::kWhole);
    ASSERT_EQ(assembler.step(packet(1000 - back, true, false), at(1001)), Assembly::kWhole);
    EXPECT_EQ(assembler.restarts(), 1U);
  }
}

TEST(FrameAssembler, SeesAClockThatStartsAnewWithinEightDatagrams) {
  for (const std::uint64_t back : {20U, 900U}) {
    FrameAssembler assembler(kMarkersOnly, kAnyOrder);
    ASSERT_EQ(assembler.step(packet(1000, true, false), at(1000)), Assembly::kWhole);
    std::uint64_t k = 1000 - back;
    int lost = 0;
    while (assembler.step(packet(k, true, false), at(1000 + k)) != Assembly::kWhole) ++k, ++lost;
    EXPECT_EQ(lost, back == 20 ? 7 : 0) << "what is far behind is no reordering";
    EXPECT_EQ(assembler.restarts(), 1U);
  }
}

TEST(FrameAssembler, SeesAClockThatLeapsButNotAPauseNorABurst) {
  FrameAssembler assembler(kMarkersOnly, kInOrder);
  (void)assembler.step(packet(0, true, false), at(0));
  (void)assembler.step(packet(1000, true, false), at(1000));  // 10 s without frames
  (void)assembler.step(packet(1001, true, false), at(2000));  // 10 s late
  EXPECT_EQ(assembler.restarts(), 0U);
  (void)assembler.step(packet(3000, true, false), at(2001));
  EXPECT_EQ(assembler.restarts(), 1U);
}

}  // namespace
}  // namespace embody::qualisys
