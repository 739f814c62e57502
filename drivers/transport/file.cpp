#include "drivers/transport/file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "drivers/transport/unique_fd.hpp"

namespace embody::transport {
namespace {

namespace fs = std::filesystem;

Error system_error(const char* action, const std::string& path, int number) {
  const Errc code = number == EACCES || number == EPERM || number == EROFS ? Errc::kPermission
                    : number == ENOENT || number == ENOTDIR                ? Errc::kNotFound
                                                                           : Errc::kIo;
  return make_error(code, "cannot %s '%.150s': %s", action, path.c_str(), std::strerror(number));
}

/// Reads until the end of the file, at most `size` bytes; false: errno says why.
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

Error exists_error(const std::string& path) {
  return make_error(Errc::kRefused, "'%.150s' exists; use --force to replace it", path.c_str());
}

bool write_whole(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = ::write(fd, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

/// Pipes, terminals and other devices, and what /dev and /proc lead to: their name must stay what it is.
bool is_device(const std::string& path) {
  struct stat info {};
  const std::string whole = fs::path(path).lexically_normal().string();
  if (whole.rfind("/dev/", 0) == 0 || whole.rfind("/proc/", 0) == 0) return true;
  return ::stat(path.c_str(), &info) == 0 && !S_ISREG(info.st_mode) && !S_ISDIR(info.st_mode);
}

Status write_to_device(std::string_view text, const std::string& path) {
  const UniqueFd file(::open(path.c_str(), O_WRONLY | O_NOCTTY | O_CLOEXEC));
  if (file.get() < 0 || !write_whole(file.get(), text)) return system_error("write", path, errno);
  return {};
}

/// Where `path` leads if it is a symbolic link, also to a file that does not exist yet.
std::string target_of(const std::string& path) {
  constexpr int kMostLinks = 40;  // as the kernel
  fs::path target(path);
  std::error_code failed;
  for (int i = 0; i < kMostLinks && fs::is_symlink(target, failed); ++i) {
    const fs::path next = fs::read_symlink(target, failed);
    if (failed) break;
    target = next.is_absolute() ? next : target.parent_path() / next;
  }
  return target.string();
}

}  // namespace

Result<std::string> load_text(const std::string& path, std::size_t most_bytes, const char* what) {
  const UniqueFd file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  struct stat info {};
  if (file.get() < 0 || ::fstat(file.get(), &info) != 0) return system_error("read", path, errno);
  if (!S_ISREG(info.st_mode)) {
    return make_error(Errc::kInvalidArgument, "'%.150s' is not a file; name %s", path.c_str(), what);
  }
  std::string text;
  const std::size_t most_read = std::min(static_cast<std::size_t>(info.st_size), most_bytes) + 1;  // one more tells
  if (!read_whole(file.get(), most_read, text)) return system_error("read", path, errno);
  if (text.size() <= most_bytes) return text;
  return make_error(Errc::kUnsupported, "'%.150s' has more than %zu KiB: this is not %s", path.c_str(),
                    most_bytes >> 10, what);
}

Status save_text(std::string_view text, const std::string& path, bool overwrite) {
  if (const Status possible = check_output(path, overwrite); !possible) return possible;
  if (is_device(path)) return write_to_device(text, path);
  const std::string target = target_of(path);
  const std::string part = target + ".part" + std::to_string(::getpid());
  const UniqueFd file(::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (file.get() < 0) return system_error("write", path, errno);
  // link() refuses an existing target, rename() replaces it; both in one step.
  const bool written =
      write_whole(file.get(), text) && ::fsync(file.get()) == 0 &&
      (overwrite ? std::rename(part.c_str(), target.c_str()) : ::link(part.c_str(), target.c_str())) == 0;
  const int cause = errno;
  if (!written || !overwrite) ::unlink(part.c_str());
  if (written) return {};
  return cause == EEXIST ? exists_error(path) : system_error("write", path, cause);
}

Status check_output(const std::string& path, bool overwrite) {
  if (path.empty()) return make_error(Errc::kInvalidArgument, "the name of a file to write is empty");
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    return make_error(Errc::kInvalidArgument, "cannot write '%.150s': it is a folder", path.c_str());
  }
  if (is_device(path)) return ::access(path.c_str(), W_OK) == 0 ? Status{} : Status{system_error("write", path, errno)};
  if (!overwrite && fs::exists(fs::symlink_status(path, ignored))) return exists_error(path);
  const fs::path parent = fs::path(target_of(path)).parent_path();
  const std::string folder = parent.empty() ? "." : parent.string();
  if (!fs::is_directory(folder, ignored)) return system_error("write", path, ENOENT);
  if (::access(folder.c_str(), W_OK | X_OK) != 0) return system_error("write", path, errno);
  return {};
}

}  // namespace embody::transport
