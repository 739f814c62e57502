// The writer: order, bounds, and a disk that is full.
#include <fstream>

#include "tests/unit/capture/support.hpp"

namespace embody::capture {
namespace {

using test::bytes;
using test::Recording;

TEST(CaptureWriter, KeepsEverythingOfSeveralThreadsInOrderOfTime) {
  Recording recording;
  constexpr int kThreads = 4, kChunks = 500;
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i) {
    threads.emplace_back([&recording] {
      const auto connection = recording.writer->connection(7);
      for (int k = 0; k < kChunks; ++k) recording.writer->bytes(connection, Event::kIn, bytes(std::to_string(k) + ","));
      recording.writer->closed(connection, End::kDevice, false);
    });
  }
  for (auto& thread : threads) thread.join();
  std::string expected;
  for (int k = 0; k < kChunks; ++k) expected += std::to_string(k) + ",";
  const Capture capture = recording.finish();  // the reader checks the times
  EXPECT_EQ(capture.chunks.size(), std::size_t{kThreads} * (kChunks + 2));
  for (std::uint32_t c = 1; c <= kThreads; ++c) EXPECT_EQ(test::bytes_of(capture, c, Event::kIn), bytes(expected));
  EXPECT_EQ(recording.writer->counters().chunks, std::uint64_t{kThreads} * kChunks);
  EXPECT_EQ(capture.header.utc_start.size(), std::string_view("2026-01-31T12:00:00Z").size());
}

TEST(CaptureWriter, AFullDiskIsOneSentence) {
  const auto opened = CaptureWriter::open("/dev/full", false, {});
  ASSERT_FALSE(opened.ok());
  EXPECT_NE(opened.error().detail.view().find("cannot write '/dev/full': No space left on device"),
            std::string_view::npos)
      << opened.error().detail.view();
}

TEST(CaptureWriter, StopsAtTheBoundWithWholeLinesAndSaysSo) {
  const test::TemporaryFolder folder;
  const std::string path = folder / "small.jsonl";
  WriterLimits limits;
  limits.file_bytes = 4096;
  auto writer = CaptureWriter::open(path, false, {}, limits);
  ASSERT_TRUE(writer.ok());
  const auto connection = (*writer)->connection(1);
  for (int i = 0; i < 1000; ++i) (*writer)->bytes(connection, Event::kIn, bytes("0123456789"));
  const Status closed = (*writer)->close();
  ASSERT_FALSE(closed.ok());
  EXPECT_NE(closed.error().detail.view().find("reached 4 KiB"), std::string_view::npos) << closed.error().detail.view();
  EXPECT_LE(std::filesystem::file_size(path), limits.file_bytes);
  EXPECT_TRUE(load_capture(path).ok());
}

TEST(CaptureWriter, ADiskSlowerThanTheLinkEndsTheCaptureNotTheLink) {
  const test::TemporaryFolder folder;
  WriterLimits limits;
  limits.queue_bytes = 100;  // the first chunk is too much
  auto writer = CaptureWriter::open(folder / "slow.jsonl", false, {}, limits);
  ASSERT_TRUE(writer.ok());
  const auto connection = (*writer)->connection(1);
  (*writer)->bytes(connection, Event::kIn, test::Bytes(1000));
  ASSERT_FALSE((*writer)->status().ok());
  EXPECT_NE((*writer)->status().error().detail.view().find("slower than the link"), std::string_view::npos);
  EXPECT_EQ((*writer)->connection(1), 0u);
  (*writer)->bytes(0, Event::kIn, test::Bytes(10));  // nothing happens
}

TEST(CaptureWriter, DoesNotReplaceAFileUnlessTold) {
  const test::TemporaryFolder folder;
  const std::string path = folder / "there";
  std::ofstream(path) << "precious";
  const auto refused = CaptureWriter::open(path, false, {});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, Errc::kRefused);
  EXPECT_EQ(std::filesystem::file_size(path), 8u);
  EXPECT_TRUE(CaptureWriter::open(path, true, {}).ok());
  EXPECT_TRUE(load_capture(path).ok());
  EXPECT_FALSE(CaptureWriter::open("/nonexistent/folder/file", false, {}).ok());
}

}  // namespace
}  // namespace embody::capture
