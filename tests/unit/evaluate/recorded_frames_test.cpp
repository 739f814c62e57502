// Frames of a recording in the slots of a glove.
#include "daemon/evaluate/recorded_frames.hpp"

#include <gtest/gtest.h>

namespace embody::evaluate {
namespace {

recording::Recording three_frames() {
  recording::Recording recording;
  recording.rate_hz = 50.0;
  recording.source = "three.tsv";
  recording.marker_names = {"pillow"};
  for (const auto& name : hand::paper_glove().names) recording.marker_names.emplace_back(name.view());
  for (int k = 0; k < 3; ++k) {
    auto& frame = recording.frames.emplace_back(recording.marker_names.size());
    for (std::size_t i = 0; i < frame.size(); ++i) frame[i] = {Eigen::Vector3d(k, static_cast<double>(i), 0.5), true};
  }
  return recording;
}

TEST(FrameRange, IsTwoNumbersOrAnOpenEnd) {
  const auto closed = parse_frame_range("1001-3000");
  ASSERT_TRUE(closed.ok());
  EXPECT_EQ(closed->first, 1001U);
  EXPECT_EQ(closed->last, 3000U);
  const auto open = parse_frame_range("7-");
  ASSERT_TRUE(open.ok());
  EXPECT_EQ(open->first, 7U);
  EXPECT_EQ(open->last, 0U);
}

TEST(FrameRange, RefusesEverythingElseInOneSentence) {
  for (const char* text : {"", "-", "-5", "0-5", "5-0", "5-4", "5", "a-b", "1-2-3", "1 - 2", "+1-2", "1-2x",
                           "99999999999999999999999-1"}) {
    const auto range = parse_frame_range(text);
    ASSERT_FALSE(range.ok()) << text;
    EXPECT_NE(range.error().detail.view().find("like 1001-3000"), std::string_view::npos) << text;
  }
}

TEST(RecordedFrames, AreInTheSlotsOfTheGloveWithNumbersAndTimesOfTheRecording) {
  const auto frames = marker_frames(three_frames(), hand::paper_glove(), {2, 3});
  ASSERT_TRUE(frames.ok()) << frames.error().detail.view();
  ASSERT_EQ(frames->size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const MarkerFrame& frame = (*frames)[i];
    EXPECT_EQ(frame.frame_number, i + 2);
    EXPECT_EQ(frame.t_capture.time_since_epoch(), std::chrono::milliseconds(20 * (i + 2)));
    ASSERT_EQ(frame.count, 13U);
    for (std::size_t slot = 0; slot < 13; ++slot) {
      EXPECT_EQ(frame.markers[slot].p_W,
                Eigen::Vector3d(static_cast<double>(i) + 1, static_cast<double>(slot) + 1, 0.5));
    }
  }
}

TEST(RecordedFrames, BeyondTheRecordingAreRefused) {
  for (const FrameRange range : {FrameRange{1, 4}, FrameRange{4, 0}, FrameRange{0, 2}}) {
    const auto frames = marker_frames(three_frames(), hand::paper_glove(), range);
    ASSERT_FALSE(frames.ok());
    EXPECT_EQ(frames.error().code, Errc::kInvalidArgument);
    EXPECT_NE(frames.error().detail.view().find("three.tsv has 3 frames"), std::string_view::npos);
  }
}

TEST(RecordedFrames, OfARecordingWithoutAMarkerOfTheGloveAreRefused) {
  recording::Recording recording = three_frames();
  recording.marker_names[5] = "thumb_tpi";
  const auto frames = marker_frames(recording, hand::paper_glove(), {});
  ASSERT_FALSE(frames.ok());
  EXPECT_NE(frames.error().detail.view().find("thumb_"), std::string_view::npos) << frames.error().detail.view();
}

}  // namespace
}  // namespace embody::evaluate
