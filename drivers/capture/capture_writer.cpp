#include "drivers/capture/capture_writer.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <ctime>

#include "drivers/capture/capture_text.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/file.hpp"

namespace embody::capture {
namespace {

std::string utc_now() {
  const std::time_t t = std::time(nullptr);
  std::tm utc{};
  ::gmtime_r(&t, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

Result<transport::UniqueFd> create(const std::string& path, bool overwrite) {
  if (const Status possible = transport::check_output(path, overwrite); !possible) return possible.error();
  struct stat info {};
  const bool device = ::stat(path.c_str(), &info) == 0 && !S_ISREG(info.st_mode);
  const int flags = device ? 0 : O_CREAT | (overwrite ? O_TRUNC : O_EXCL);
  transport::UniqueFd file(::open(path.c_str(), O_WRONLY | O_NOCTTY | O_CLOEXEC | flags, 0666));
  if (file) return file;
  return make_error(errno == EACCES ? Errc::kPermission : Errc::kIo, "cannot write '%.150s': %s", path.c_str(),
                    std::strerror(errno));
}

}  // namespace

Result<std::unique_ptr<CaptureWriter>> CaptureWriter::open(const std::string& path, bool overwrite, Header header,
                                                           WriterLimits limits) {
  auto file = create(path, overwrite);
  if (!file) return file.error();
  header.utc_start = utc_now();
  std::unique_ptr<CaptureWriter> writer(new CaptureWriter(std::move(*file), path, limits));
  const std::string line = header_line(header);
  writer->file_bytes_ = line.size();
  if (!writer->write_out(line)) return writer->status_.error();  // now, so that a full disk is noticed at once
  writer->thread_ = std::thread([raw = writer.get()] { raw->run(); });
  return writer;
}

CaptureWriter::CaptureWriter(transport::UniqueFd file, std::string path, WriterLimits limits)
    : path_(std::move(path)), limits_(limits), t_start_(transport::now()), file_(std::move(file)) {}

CaptureWriter::~CaptureWriter() {
  static_cast<void>(close());
}

std::uint32_t CaptureWriter::connection(std::uint16_t port) {
  const std::scoped_lock lock(mutex_);
  if (!status_ || closing_) return 0;
  if (counters_.connections == kMaxConnections) {
    fail(make_error(Errc::kIo, "the capture ended after %u connections, the most that a file may hold",
                    kMaxConnections));
    return 0;
  }
  Chunk chunk;
  chunk.connection = static_cast<std::uint32_t>(++counters_.connections);
  chunk.event = Event::kOpen;
  chunk.port = port;
  record(chunk, {});
  return chunk.connection;
}

void CaptureWriter::bytes(std::uint32_t connection, Event direction, std::span<const std::byte> bytes) {
  const std::scoped_lock lock(mutex_);
  if (!status_ || closing_ || connection == 0) return;
  Chunk chunk;
  chunk.connection = connection;
  chunk.event = direction;
  record(chunk, bytes);
  ++counters_.chunks;
  (direction == Event::kIn ? counters_.bytes_in : counters_.bytes_out) += bytes.size();
}

void CaptureWriter::closed(std::uint32_t connection, End by, bool reset) {
  const std::scoped_lock lock(mutex_);
  if (!status_ || closing_ || connection == 0) return;
  Chunk chunk;
  chunk.connection = connection;
  chunk.event = Event::kClose;
  chunk.by = by;
  chunk.reset = reset;
  record(chunk, {});
}

/// Under the mutex, so that lines are in order of time.
void CaptureWriter::record(Chunk chunk, std::span<const std::byte> bytes) {
  chunk.t_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(transport::now() - t_start_).count();
  const std::size_t before = queue_.size();
  append_chunk_line(chunk, bytes, queue_);
  file_bytes_ += queue_.size() - before;
  const bool too_long = file_bytes_ > limits_.file_bytes;
  if (too_long || queue_.size() > limits_.queue_bytes) queue_.resize(before);  // whole lines only
  if (too_long) {
    fail(make_error(Errc::kIo, "the capture ended because '%.120s' reached %zu KiB, the most that can be read again",
                    path_.c_str(), limits_.file_bytes >> 10));
  } else if (queue_.size() == before) {
    fail(
        make_error(Errc::kIo, "the capture ended because the disk of '%.120s' is slower than the link", path_.c_str()));
  }
  wake_.notify_one();
}

void CaptureWriter::fail(const Error& error) {
  if (status_) status_ = error;
}

Status CaptureWriter::status() const {
  const std::scoped_lock lock(mutex_);
  return status_;
}

CaptureCounters CaptureWriter::counters() const {
  const std::scoped_lock lock(mutex_);
  return counters_;
}

Status CaptureWriter::close() {
  {
    const std::scoped_lock lock(mutex_);
    closing_ = true;
  }
  wake_.notify_one();
  if (thread_.joinable()) thread_.join();
  if (!file_) return status_;
  const bool saved =
      ::fsync(file_.get()) == 0 || errno == EINVAL || errno == EROFS;  // pipes and terminals have no fsync
  if (!saved) {
    fail(make_error(Errc::kIo, "cannot write '%.120s': %s", path_.c_str(), std::strerror(errno)));
  }
  file_.reset();
  return status_;
}

void CaptureWriter::run() {
  std::string text;
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return closing_ || !queue_.empty(); });
    if (queue_.empty()) return;
    text.clear();
    text.swap(queue_);
    lock.unlock();
    const bool written = write_out(text);
    lock.lock();
    if (!written) return;
  }
}

/// Called without the mutex.
bool CaptureWriter::write_out(std::string_view text) {
  while (!text.empty()) {
    const ssize_t size = ::write(file_.get(), text.data(), text.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) {
      const Error error =
          make_error(Errc::kIo, "the capture ended: cannot write '%.120s': %s", path_.c_str(), std::strerror(errno));
      const std::scoped_lock lock(mutex_);
      fail(error);
      return false;
    }
    text.remove_prefix(static_cast<std::size_t>(size));
  }
  return true;
}

}  // namespace embody::capture
