#include "drivers/transport/can_double.hpp"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <cerrno>
#include <cstring>

namespace embody::transport {
namespace {

constexpr std::string_view kPrefix = "unix:";
constexpr int kType = SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC;

Result<sockaddr_un> address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) {
    return make_error(Errc::kInvalidArgument, "'unix:%.60s' is no usable name: a path of 1 to %zu bytes is needed",
                      path.c_str(), sizeof address.sun_path - 1);
  }
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

Result<UniqueFd> open_socket() {
  UniqueFd fd(::socket(AF_UNIX, kType, 0));
  if (!fd) return make_error(Errc::kIo, "cannot create a Unix socket: %s", std::strerror(errno));
  return fd;
}

}  // namespace

std::optional<std::string> double_path(std::string_view interface) {
  if (interface.substr(0, kPrefix.size()) != kPrefix) return std::nullopt;
  return std::string(interface.substr(kPrefix.size()));
}

Result<UniqueFd> double_listen(const std::string& path) {
  const auto address = address_of(path);
  if (!address) return address.error();
  struct stat status {};
  if (::lstat(path.c_str(), &status) == 0) {
    if (!S_ISSOCK(status.st_mode)) {
      return make_error(Errc::kRefused, "%s exists and is not a socket: remove it or choose another path",
                        path.c_str());
    }
    if (double_connect(path)) return make_error(Errc::kRefused, "%s is in use by another program", path.c_str());
    ::unlink(path.c_str());
  }
  auto fd = open_socket();
  if (!fd) return fd;
  const auto* generic = reinterpret_cast<const sockaddr*>(&*address);
  if (::bind(fd->get(), generic, sizeof *address) != 0 || ::listen(fd->get(), 4) != 0) {
    return make_error(Errc::kIo, "cannot listen at %s: %s", path.c_str(), std::strerror(errno));
  }
  return fd;
}

Result<UniqueFd> double_connect(const std::string& path) {
  const auto address = address_of(path);
  if (!address) return address.error();
  auto fd = open_socket();
  if (!fd) return fd;
  if (::connect(fd->get(), reinterpret_cast<const sockaddr*>(&*address), sizeof *address) == 0) return fd;
  if (errno == EACCES) return make_error(Errc::kPermission, "no permission to open %s", path.c_str());
  return make_error(Errc::kDisconnected, "no simulated CAN bus at unix:%s: %s", path.c_str(), std::strerror(errno));
}

UniqueFd double_accept(int listener) noexcept {
  return UniqueFd(::accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
}

Result<std::array<UniqueFd, 2>> double_pair() {
  int ends[2];
  if (::socketpair(AF_UNIX, kType, 0, ends) != 0) {
    return make_error(Errc::kIo, "cannot create a pair of sockets: %s", std::strerror(errno));
  }
  return std::array<UniqueFd, 2>{UniqueFd(ends[0]), UniqueFd(ends[1])};
}

}  // namespace embody::transport
