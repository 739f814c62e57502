#pragma once
// Writes a capture while it is made. Whoever records never waits for the disk: lines go to a bounded queue, which an
// own thread empties. For offline tools; recording allocates and takes a mutex for the time of a copy.
#include <condition_variable>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>

#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "drivers/capture/capture.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::capture {

struct WriterLimits {
  std::size_t queue_bytes{std::size_t{16} << 20};  ///< not yet on the disk
  std::size_t file_bytes{kMaxCaptureBytes};
};

struct CaptureCounters {
  std::uint64_t connections{0};
  std::uint64_t chunks{0};  ///< of bytes
  std::uint64_t bytes_in{0};
  std::uint64_t bytes_out{0};
};

/// All functions but close() may be called from any thread. After the first failure (disk full, disk slower than the
/// link, file too long) nothing is recorded any more and status() says why; what the file holds until then can be read,
/// except perhaps its last line.
class CaptureWriter {
 public:
  /// Creates the file and writes the header; `utc_start` is set here. Errors: those of transport::check_output(), kIo.
  [[nodiscard]] static Result<std::unique_ptr<CaptureWriter>> open(const std::string& path, bool overwrite,
                                                                   Header header, WriterLimits limits = {});
  ~CaptureWriter();
  CaptureWriter(const CaptureWriter&) = delete;
  CaptureWriter& operator=(const CaptureWriter&) = delete;

  /// A new connection to the device's `port`; returns its number, 0 when nothing is recorded any more.
  std::uint32_t connection(std::uint16_t port);
  /// At most kMaxChunkBytes at a time.
  void bytes(std::uint32_t connection, Event direction, std::span<const std::byte> bytes);
  /// `by` has closed its direction, or both with a reset.
  void closed(std::uint32_t connection, End by, bool reset);

  [[nodiscard]] Status status() const;
  [[nodiscard]] CaptureCounters counters() const;
  /// Writes what is queued and closes the file; nothing is recorded afterwards. Returns status().
  Status close();

 private:
  CaptureWriter(transport::UniqueFd file, std::string path, WriterLimits limits);
  void record(Chunk chunk, std::span<const std::byte> bytes);
  void fail(const Error& error);
  void run();
  bool write_out(std::string_view text);

  const std::string path_;
  const WriterLimits limits_;
  const TimePoint t_start_;
  transport::UniqueFd file_;  // of the thread
  mutable std::mutex mutex_;  // of what follows
  std::condition_variable wake_;
  std::string queue_;
  std::size_t file_bytes_{0};
  CaptureCounters counters_;
  Status status_;
  bool closing_{false};
  std::thread thread_;
};

}  // namespace embody::capture
