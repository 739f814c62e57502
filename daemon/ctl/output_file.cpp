#include "daemon/ctl/output_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "drivers/transport/unique_fd.hpp"

namespace embody::ctl {
namespace {

Error system_error(const std::string& path, int number) {
  const Errc code = number == EACCES || number == EPERM || number == EROFS ? Errc::kPermission
                    : number == ENOENT || number == ENOTDIR                ? Errc::kNotFound
                                                                           : Errc::kIo;
  return make_error(code, "cannot write '%.150s': %s", path.c_str(), std::strerror(number));
}

Error exists_error(const std::string& path) {
  return make_error(Errc::kRefused, "'%.150s' exists; use --force to replace it", path.c_str());
}

bool write_whole(int fd, const std::string& text) {
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t n = ::write(fd, text.data() + done, text.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    done += static_cast<std::size_t>(n);
  }
  return ::fsync(fd) == 0;
}

}  // namespace

Status save_text(const std::string& text, const std::string& path, bool overwrite) {
  const std::string part = path + ".part" + std::to_string(::getpid());
  transport::UniqueFd file(::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (file.get() < 0) return system_error(path, errno);
  // link() refuses an existing target, rename() replaces it; both in one step.
  const bool written = write_whole(file.get(), text) &&
                       (overwrite ? std::rename(part.c_str(), path.c_str()) : ::link(part.c_str(), path.c_str())) == 0;
  const int cause = errno;
  if (!written || !overwrite) ::unlink(part.c_str());
  if (written) return {};
  return cause == EEXIST ? exists_error(path) : system_error(path, cause);
}

Status check_output(const std::string& path, bool overwrite) {
  std::error_code ignored;
  if (!overwrite && std::filesystem::exists(std::filesystem::symlink_status(path, ignored))) return exists_error(path);
  const std::filesystem::path parent = std::filesystem::path(path).parent_path();
  const std::string folder = parent.empty() ? "." : parent.string();
  if (::access(folder.c_str(), W_OK | X_OK) != 0) return system_error(path, errno);
  return {};
}

}  // namespace embody::ctl
