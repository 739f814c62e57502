#include "daemon/control/listen.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

namespace embody::control {
namespace {

using transport::UniqueFd;

Error system_error(const char* what, const std::string& path, int number) {
  const Errc code = number == EACCES || number == EPERM || number == EROFS ? Errc::kPermission : Errc::kIo;
  return make_error(code, "control socket: %s %.100s: %s", what, path.c_str(), std::strerror(number));
}

/// The folder must exist or be creatable, and nobody else may exchange the socket in it.
Result<UniqueFd> open_folder(const std::string& folder, bool group_access, const SocketOwner& owner) {
  const mode_t mode = group_access ? 0750 : 0700;
  if (::mkdir(folder.c_str(), mode) != 0 && errno != EEXIST) {
    return system_error("cannot create folder", folder, errno);
  }
  UniqueFd fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
  struct stat status {};
  if (!fd || ::fstat(fd.get(), &status) != 0) return system_error("cannot open folder", folder, errno);
  const bool ours = status.st_uid == ::geteuid() || status.st_uid == 0;
  const bool sticky = (status.st_mode & S_ISVTX) != 0;
  if (!ours || ((status.st_mode & S_IWOTH) != 0 && !sticky)) {
    return make_error(Errc::kInvalidArgument,
                      "control socket: folder %.100s belongs to another user or anybody may write to it; remove it or "
                      "set %s",
                      folder.c_str(), owner.setting);
  }
  return fd;
}

/// Excludes a second daemon that starts at the same moment. Tries for a second.
Status lock_folder(int fd, const std::string& folder) {
  for (int i = 0; i < 100; ++i) {
    if (::flock(fd, LOCK_EX | LOCK_NB) == 0) return {};
    if (errno != EWOULDBLOCK && errno != EINTR) return system_error("cannot lock folder", folder, errno);
    ::usleep(10'000);
  }
  return system_error("cannot lock folder", folder, EWOULDBLOCK);
}

/// Removes a socket that nobody listens on.
Status remove_stale(const std::string& path, const sockaddr_un& address, const SocketOwner& owner) {
  struct stat status {};
  if (::lstat(path.c_str(), &status) != 0) {
    return errno == ENOENT ? Status() : Status(system_error("cannot look at", path, errno));
  }
  if (!S_ISSOCK(status.st_mode)) {
    return make_error(Errc::kInvalidArgument, "control socket: %.100s exists and is no socket; remove it",
                      path.c_str());
  }
  UniqueFd probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  // EAGAIN: somebody listens and has a full backlog. Only a refusal means that nobody is there.
  if (::connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ||
      (errno != ECONNREFUSED && errno != ENOENT)) {
    return make_error(Errc::kRefused, "another %s answers on %.100s: stop it first (%s) or give this one another %s",
                      owner.program, path.c_str(), owner.how_to_end, owner.setting);
  }
  if (::unlink(path.c_str()) != 0 && errno != ENOENT) return system_error("cannot remove stale", path, errno);
  return {};
}

}  // namespace

SocketFile& SocketFile::operator=(SocketFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(device_, other.device_);
  std::swap(inode_, other.inode_);
  return *this;
}

SocketFile::~SocketFile() {
  struct stat status {};
  if (!path_.empty() && ::lstat(path_.c_str(), &status) == 0 && status.st_dev == device_ && status.st_ino == inode_) {
    ::unlink(path_.c_str());
  }
}

Result<Listener> listen_unix(const std::string& path, bool group_access, const SocketOwner& owner) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path || path.front() != '/') {
    return make_error(Errc::kInvalidArgument,
                      "control socket: the path must be absolute and shorter than %zu bytes: %.100s",
                      sizeof address.sun_path, path.c_str());
  }
  std::memcpy(address.sun_path, path.c_str(), path.size());
  const std::string folder = std::filesystem::path(path).parent_path().string();

  auto lock = open_folder(folder, group_access, owner);
  if (!lock) return lock.error();
  if (const auto locked = lock_folder(lock->get(), folder); !locked) return locked.error();
  if (const auto removed = remove_stale(path, address, owner); !removed) return removed.error();

  UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const mode_t mode = group_access ? 0660 : 0600;
  // The mode is set before the name exists (bind() copies it, less the umask), and once more for the umask.
  if (!fd || ::fchmod(fd.get(), mode) != 0) return system_error("cannot create", path, errno);
  if (::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return system_error("cannot bind", path, errno);
  }
  struct stat status {};
  if (::lstat(path.c_str(), &status) != 0) return system_error("cannot look at", path, errno);
  SocketFile file(path, status.st_dev, status.st_ino);
  if (::chmod(path.c_str(), mode) != 0) return system_error("cannot set the mode of", path, errno);
  if (::listen(fd.get(), 16) != 0) return system_error("cannot listen on", path, errno);
  return Listener{std::move(fd), std::move(file)};
}

}  // namespace embody::control
