// Captures of the simulated devices replayed to the real drivers: the same readings whatever the chunking. With
// EMBODY_CAPTURE_OUT=FOLDER the captures stay there; that is how the fixtures in tests/data/captures were made.
#include "tests/unit/capture/device_captures.hpp"
#include "tests/unit/capture/replay_drivers.hpp"
#include "tests/unit/capture/support.hpp"

namespace embody::test {
namespace {

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

INSTANTIATE_TEST_SUITE_P(Links, DeviceCapture, testing::ValuesIn(kLinks),
                         [](const auto& link) { return std::string(link.param.name); });

}  // namespace
}  // namespace embody::test
