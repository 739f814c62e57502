#pragma once
// What the tests of captures share.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "drivers/capture/capture_text.hpp"
#include "drivers/capture/capture_writer.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::test {

using Bytes = std::vector<std::byte>;

inline Bytes bytes(std::string_view text) {
  const auto view = std::as_bytes(std::span(text));
  return {view.begin(), view.end()};
}

/// True as soon as `condition` holds, false after ten seconds.
template <class Condition>
bool eventually(Condition condition) {
  const auto deadline = transport::now() + std::chrono::seconds(10);
  while (!condition()) {
    if (transport::now() >= deadline) return false;
    std::this_thread::yield();
  }
  return true;
}

/// A folder of its own that goes with the test.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = testing::TempDir() + "capture-XXXXXX";
    path_ = ::mkdtemp(pattern.data());
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  [[nodiscard]] std::string operator/(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

/// A writer to a temporary file, and what the file holds in the end.
struct Recording {
  explicit Recording(capture::LinkKind link = capture::LinkKind::kQtm) {
    capture::Header header;
    header.link = link;
    header.peer = "somewhere";
    header.program = "test";
    auto opened = capture::CaptureWriter::open(path, false, header);
    EXPECT_TRUE(opened.ok()) << opened.error().detail.view();
    if (opened) writer = std::move(*opened);
  }
  capture::Capture finish() {
    const Status closed = writer->close();
    EXPECT_TRUE(closed.ok()) << closed.error().detail.view();
    auto capture = capture::load_capture(path);
    EXPECT_TRUE(capture.ok()) << capture.error().detail.view();
    return capture ? std::move(*capture) : capture::Capture{};
  }

  TemporaryFolder folder;
  std::string path = folder / "capture.jsonl";
  std::unique_ptr<capture::CaptureWriter> writer;
};

/// All bytes of one direction of a connection.
inline Bytes bytes_of(const capture::Capture& capture, std::uint32_t connection, capture::Event direction) {
  Bytes all;
  for (const auto& chunk : capture.chunks) {
    if (chunk.connection != connection || chunk.event != direction) continue;
    all.insert(all.end(), chunk.bytes.begin(), chunk.bytes.end());
  }
  return all;
}

/// Receives until there are `size` bytes, the stream ends, or ten seconds are over.
inline Bytes receive_bytes(int fd, std::size_t size) {
  Bytes all(size);
  std::size_t got = 0;
  const auto deadline = transport::now() + std::chrono::seconds(10);
  while (got < size && transport::wait_readable(fd, deadline)) {
    const auto received = transport::receive(fd, std::span(all).subspan(got));
    if (received.status == IoStatus::kDisconnected) break;
    got += received.size;
  }
  all.resize(got);
  return all;
}

}  // namespace embody::test
