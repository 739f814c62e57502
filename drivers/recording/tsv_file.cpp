#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "drivers/recording/tsv_recording.hpp"

namespace embody::recording {
namespace {

class File {
 public:
  File(const std::string& path, int flags) : fd_(::open(path.c_str(), flags | O_CLOEXEC, 0644)) {}
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] int get() const noexcept { return fd_; }
  /// Closes early, to learn whether the data arrived.
  [[nodiscard]] bool close() noexcept { return ::close(std::exchange(fd_, -1)) == 0; }

 private:
  int fd_;
};

Error system_error(const char* action, const std::string& path) {
  const int cause = errno;
  const Errc code = cause == ENOENT ? Errc::kNotFound : cause == EACCES ? Errc::kPermission : Errc::kIo;
  return make_error(code, "cannot %s '%.150s': %s", action, path.c_str(), std::strerror(cause));
}

/// Reads until the end of the file, at most `size` bytes.
bool read_whole(int fd, std::size_t size, std::string& text) {
  text.resize(size);
  std::size_t done = 0;
  while (done < size) {
    const ssize_t count = ::read(fd, text.data() + done, size - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return false;
    if (count == 0) break;
    done += static_cast<std::size_t>(count);
  }
  text.resize(done);
  return true;
}

bool write_whole(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = ::write(fd, text.data(), text.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return false;
    text.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

}  // namespace

Result<Recording> load_tsv(const std::string& path) {
  File file(path, O_RDONLY | O_NONBLOCK);  // a pipe without a writer must not block; it is refused below
  struct stat info {};
  if (file.get() < 0 || ::fstat(file.get(), &info) != 0) return system_error("read", path);
  if (!S_ISREG(info.st_mode)) {
    return make_error(Errc::kInvalidArgument, "'%.150s' is not a file; name a QTM motion export (.tsv)", path.c_str());
  }
  const auto size = static_cast<std::size_t>(info.st_size);
  if (size > kMaxTsvBytes) {
    return make_error(Errc::kUnsupported, "'%.150s' has %zu MiB, more than %zu; export a shorter range", path.c_str(),
                      size >> 20, kMaxTsvBytes >> 20);
  }
  std::string text;
  if (!read_whole(file.get(), size, text)) return system_error("read", path);
  return parse_tsv(text, path);
}

Status save_tsv(const Recording& recording, const std::string& path) {
  const auto text = format_tsv(recording);
  if (!text) return text.error();
  File file(path, O_WRONLY | O_CREAT | O_TRUNC);
  if (file.get() < 0 || !write_whole(file.get(), *text) || !file.close()) return system_error("write", path);
  return {};
}

}  // namespace embody::recording
