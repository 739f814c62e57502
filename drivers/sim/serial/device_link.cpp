#include "drivers/sim/serial/device_link.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <climits>
#include <cstring>

namespace embody::sim {

Status DeviceLink::create(const std::string& path, const std::string& device) {
  remove();
  struct stat status {};
  if (::lstat(path.c_str(), &status) == 0) {
    if (!S_ISLNK(status.st_mode)) {
      return make_error(Errc::kRefused, "%s exists and is not a symlink: remove it or choose another path",
                        path.c_str());
    }
    ::unlink(path.c_str());
  }
  if (::symlink(device.c_str(), path.c_str()) != 0) {
    return make_error(Errc::kIo, "cannot create the symlink %s: %s", path.c_str(), std::strerror(errno));
  }
  path_ = path;
  device_ = device;
  return {};
}

void DeviceLink::remove() noexcept {
  if (path_.empty()) return;
  std::array<char, PATH_MAX> target{};
  const ssize_t size = ::readlink(path_.c_str(), target.data(), target.size());
  if (size >= 0 && device_.compare(0, std::string::npos, target.data(), static_cast<std::size_t>(size)) == 0) {
    ::unlink(path_.c_str());
  }
  path_.clear();
}

}  // namespace embody::sim
