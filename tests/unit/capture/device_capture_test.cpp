// Captures of the simulated devices replayed to the real drivers: the same readings whatever the chunking. With
// EMBODY_CAPTURE_OUT=FOLDER the captures stay there; that is how the fixtures in tests/data/captures were made.
#include "drivers/capture/can_listener.hpp"
#include "drivers/mia/can_segments.hpp"
#include "tests/unit/capture/device_captures.hpp"
#include "tests/unit/capture/isotp_frames.hpp"
#include "tests/unit/capture/replay_drivers.hpp"
#include "tests/unit/capture/support.hpp"

namespace embody::test {
namespace {

using capture::CanReplayAs;
using capture::Capture;
using capture::Chunking;
using capture::load_capture;
using capture::ReplayOptions;

struct Link {
  const char* name;
  std::size_t (*make)(const std::string& path);
  Replayed (*replay)(const Capture& capture, ReplayOptions options);
};

const Link kLinks[] = {
    {"qtm", &capture_tracker,
     [](const Capture& c, ReplayOptions options) { return replay_tracker(c, options, captured_markers()); }},
    {"rtde", &capture_arm,
     [](const Capture& c, ReplayOptions options) { return replay_arm(c, options, kCapturedArmRate_hz); }},
    {"mia", &capture_hand, [](const Capture& c, ReplayOptions options) { return replay_hand(c, options); }},
    {"mia_can_segments", &capture_can_tunnel,
     [](const Capture& c, ReplayOptions) { return replay_can_tunnel(c, CanReplayAs::kFrames); }},
};

/// All two-part splits; under a sanitizer, which is slow, not all of the longer chunks.
constexpr std::size_t kClose = 64;
#ifdef EMBODY_SANITIZED
constexpr std::size_t kStride = 29;
#else
constexpr std::size_t kStride = 1;
#endif

std::string fixture(const Link& link) {
  return std::string(EMBODY_SOURCE_DIR) + "/tests/data/captures/" + link.name + ".jsonl";
}

class DeviceCapture : public testing::TestWithParam<Link> {
 protected:
  static Capture load(const std::string& path) {
    auto capture = load_capture(path);
    EXPECT_TRUE(capture.ok()) << capture.error().detail.view();
    return capture ? std::move(*capture) : Capture{};
  }
  void expect_same(const Capture& capture, Chunking chunking, const Replayed& expected) const {
    const Replayed got = GetParam().replay(capture, {chunking});
    ASSERT_EQ(got.failure, "") << "pieces " << chunking.first << ", " << chunking.rest;
    ASSERT_EQ(got.readings, expected.readings) << "pieces " << chunking.first << ", " << chunking.rest;
    ASSERT_EQ(got.report.sent, expected.report.sent);
  }
};

TEST_P(DeviceCapture, ReplaysToTheReadingsOfTheLiveRun) {
  const TemporaryFolder folder;
  const char* kept = std::getenv("EMBODY_CAPTURE_OUT");
  const std::string name = std::string(GetParam().name) + ".jsonl";
  const std::string path = kept != nullptr ? std::string(kept) + "/" + name : folder / name;
  const std::size_t live = GetParam().make(path);
  ASSERT_GT(live, 20u);
  const Capture capture = load(path);
  const Replayed whole = GetParam().replay(capture, {});
  ASSERT_EQ(whole.failure, "");
  EXPECT_GE(whole.readings.size(), live);  // the file may hold bytes that had not been read yet
  EXPECT_LE(whole.readings.size(), live + 2);
  for (const std::size_t size : {1u, 7u}) expect_same(capture, Chunking::pieces(size), whole);
}

TEST_P(DeviceCapture, TheFixtureGivesTheSameReadingsInEveryChunking) {
  const Capture capture = load(fixture(GetParam()));
  EXPECT_LT(std::filesystem::file_size(fixture(GetParam())), 60'000u);
  const Replayed whole = GetParam().replay(capture, {});
  ASSERT_EQ(whole.failure, "");
  ASSERT_GT(whole.readings.size(), 20u);
  for (const std::size_t size : {1u, 2u, 3u, 5u, 16u, 64u}) expect_same(capture, Chunking::pieces(size), whole);
  const std::size_t longest = longest_chunk(capture);
  for (std::size_t offset = 1; offset < longest && !HasFatalFailure(); offset += offset < kClose ? 1 : kStride) {
    expect_same(capture, Chunking::two_parts(offset), whole);
  }
  std::printf("%s: %zu readings of %zu bytes, the longest chunk has %zu\n", GetParam().name, whole.readings.size(),
              whole.report.sent, longest);
}

/// A device that dies in the middle: the driver reports what came before, then the end of the session.
TEST_P(DeviceCapture, AConnectionThatBreaksOffAnywhereEndsTheSessionWithTheSameReadingsUntilThen) {
  const Capture capture = load(fixture(GetParam()));
  const Replayed whole = GetParam().replay(capture, {});
  ASSERT_EQ(whole.failure, "");
  const std::size_t step = std::max<std::size_t>(1, capture.chunks.size() / 20);
  for (std::size_t end = 1; end < capture.chunks.size(); end += step) {
    Capture part = capture;
    part.chunks.resize(end);
    const auto is_open = [](const capture::Chunk& chunk) { return chunk.event == capture::Event::kOpen; };
    const auto opened = std::count_if(part.chunks.begin(), part.chunks.end(), is_open);
    for (std::uint32_t c = 1; c <= opened; ++c) {
      capture::Chunk close;
      close.connection = c;
      close.event = capture::Event::kClose;
      close.by = capture::End::kDevice;
      part.chunks.push_back(close);
    }
    const Replayed got = GetParam().replay(part, {});
    EXPECT_NE(got.failure, "") << "after " << end << " chunks";
    ASSERT_LE(got.readings.size(), whole.readings.size());
    for (std::size_t i = 0; i < got.readings.size(); ++i) ASSERT_EQ(got.readings[i], whole.readings[i]);
  }
}

/// `segments` with the same messages as frames of ISO-TP; both are what a listener on the bus records.
Capture as_isotp(const Capture& segments) {
  Capture isotp{segments.header, {}};
  mia::SegmentAssembler host(std::chrono::seconds(1)), device(std::chrono::seconds(1));
  for (const capture::Chunk& chunk : segments.chunks) {
    if (chunk.event != capture::Event::kIn && chunk.event != capture::Event::kOut) {
      isotp.chunks.push_back(chunk);
      continue;
    }
    auto& assembler = chunk.event == capture::Event::kOut ? host : device;
    const auto message =
        assembler.push(capture::frame_of(chunk.bytes)->bytes(), TimePoint(std::chrono::nanoseconds(chunk.t_ns)));
    if (!message) continue;
    for (const auto& data : isotp_frames(std::as_bytes(std::span(*message)), true)) {
      capture::Chunk frame = chunk;
      frame.bytes.resize(4);  // the identifier
      frame.bytes.insert(frame.bytes.end(), data.begin(), data.end());
      isotp.chunks.push_back(std::move(frame));
    }
  }
  return isotp;
}

TEST(CanCapture, IsoTpGivesTheReadingsOfTheSameMessagesInSegments) {
  const auto segments = load_capture(std::string(EMBODY_SOURCE_DIR) + "/tests/data/captures/mia_can_segments.jsonl");
  ASSERT_TRUE(segments.ok()) << segments.error().detail.view();
  const Replayed expected = replay_can_tunnel(*segments, CanReplayAs::kFrames);
  const Replayed got = replay_can_tunnel(as_isotp(*segments), CanReplayAs::kIsoTpMessages);
  EXPECT_EQ(expected.failure, "");
  EXPECT_EQ(got.failure, "");
  EXPECT_GT(got.readings.size(), 20u);
  EXPECT_EQ(got.readings, expected.readings);
}

/// Every frame is understood, live and from the fixture, and the hand is where it was.
TEST(CanCapture, TheCompactProfileReplaysWithoutADamagedOrLostFrame) {
  const TemporaryFolder folder;
  const char* kept = std::getenv("EMBODY_CAPTURE_OUT");
  const std::string path = kept != nullptr ? std::string(kept) + "/mia_can_compact.jsonl" : folder / "live.jsonl";
  ASSERT_GT(capture_can_compact(path), 20u);
  std::vector<std::string> live;
  for (const auto& file : {path, std::string(EMBODY_SOURCE_DIR) + "/tests/data/captures/mia_can_compact.jsonl"}) {
    const auto capture = load_capture(file);
    ASSERT_TRUE(capture.ok()) << capture.error().detail.view();
    const Replayed got = replay_can_compact(*capture);
    EXPECT_EQ(got.failure, "");
    ASSERT_EQ(got.readings.size(), 2u);
    EXPECT_EQ(got.readings[1], "0 damaged, 0 lost, 0 repeated");
    const auto is_in = [](const capture::Chunk& chunk) { return chunk.event == capture::Event::kIn; };
    EXPECT_EQ(got.report.sent,
              static_cast<std::size_t>(std::count_if(capture->chunks.begin(), capture->chunks.end(), is_in)));
    if (live.empty()) live = got.readings;
    EXPECT_EQ(got.readings, live) << "the hands stood at the same place";
  }
}

TEST(CanCapture, ACompactSessionWithAFrameOutOfPlaceCountsIt) {
  auto capture = load_capture(std::string(EMBODY_SOURCE_DIR) + "/tests/data/captures/mia_can_compact.jsonl");
  ASSERT_TRUE(capture.ok());
  std::vector<std::size_t> states;  // of the thumb: their last byte is a counter
  for (std::size_t i = 0; i < capture->chunks.size(); ++i) {
    if (capture->chunks[i].event == capture::Event::kIn && capture->chunks[i].bytes[3] == std::byte{0x10})
      states.push_back(i);
  }
  ASSERT_GT(states.size(), 10u);
  capture->chunks.erase(capture->chunks.begin() + static_cast<std::ptrdiff_t>(states[8]));
  const Replayed got = replay_can_compact(*capture);
  EXPECT_EQ(got.failure, "");
  EXPECT_EQ(got.readings.back(), "0 damaged, 1 lost, 0 repeated");
}

INSTANTIATE_TEST_SUITE_P(Links, DeviceCapture, testing::ValuesIn(kLinks),
                         [](const auto& link) { return std::string(link.param.name); });

}  // namespace
}  // namespace embody::test
