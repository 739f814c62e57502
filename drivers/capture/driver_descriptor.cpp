#include "drivers/capture/driver_descriptor.hpp"

#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <string_view>

namespace embody::capture {
namespace {

constexpr int kHighestDescriptor = 1024;

using NameOf = int (*)(int, sockaddr*, socklen_t*);

bool same_name(int a, NameOf name_of_a, int b, NameOf name_of_b) noexcept {
  sockaddr_in first{}, second{};
  socklen_t first_size = sizeof first, second_size = sizeof second;
  return name_of_a(a, reinterpret_cast<sockaddr*>(&first), &first_size) == 0 && first.sin_family == AF_INET &&
         name_of_b(b, reinterpret_cast<sockaddr*>(&second), &second_size) == 0 && second.sin_family == AF_INET &&
         first.sin_port == second.sin_port && first.sin_addr.s_addr == second.sin_addr.s_addr;
}

}  // namespace

bool is_far_end(int fd, int ours, const std::string& device) {
  if (fd < 0) return false;
  if (device.empty()) {
    return same_name(fd, &::getsockname, ours, &::getpeername) && same_name(fd, &::getpeername, ours, &::getsockname);
  }
  std::array<char, 64> name{};
  const std::string link = "/proc/self/fd/" + std::to_string(fd);
  const ssize_t size = ::readlink(link.c_str(), name.data(), name.size());
  return size > 0 && device == std::string_view(name.data(), static_cast<std::size_t>(size));
}

int find_far_end(int ours, const std::string& device) {
  for (int fd = 0; fd < kHighestDescriptor; ++fd) {
    if (is_far_end(fd, ours, device)) return fd;
  }
  return -1;
}

int unread_bytes(int fd) noexcept {
  int size = 0;
  // Not through the C library: a sanitizer takes a look at another thread's descriptor for a race.
  return ::syscall(SYS_ioctl, fd, FIONREAD, &size) == 0 ? size : -1;
}

}  // namespace embody::capture
