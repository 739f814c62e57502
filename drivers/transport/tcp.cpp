#include "drivers/transport/tcp.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>

#include "drivers/transport/clock.hpp"

namespace embody::transport {
namespace {

int milliseconds_until(TimePoint deadline) noexcept {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - now()).count();
  return static_cast<int>(std::clamp<std::int64_t>(left, 0, 60'000));
}

bool wait_for(int fd, short events, TimePoint deadline) noexcept {
  while (true) {
    pollfd entry{fd, events, 0};
    const int count = ::poll(&entry, 1, milliseconds_until(deadline));
    if (count > 0) return true;
    if (count == 0 && now() >= deadline) return false;
    if (count < 0 && errno != EINTR) return true;
  }
}

void set_no_delay(int fd) noexcept {
  const int on = 1;
  ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

Result<UniqueFd> connect_to(const sockaddr* address, socklen_t size, const char* peer, TimePoint deadline) {
  UniqueFd fd(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!fd) return make_error(Errc::kIo, "cannot create a socket: %s", std::strerror(errno));
  set_no_delay(fd.get());
  if (::connect(fd.get(), address, size) == 0) return fd;
  if (errno != EINPROGRESS) return make_error(Errc::kDisconnected, "%s: %s", peer, std::strerror(errno));
  if (!wait_for(fd.get(), POLLOUT, deadline)) return make_error(Errc::kTimeout, "%s does not answer", peer);
  int failure = 0;
  socklen_t length = sizeof failure;
  ::getsockopt(fd.get(), SOL_SOCKET, SO_ERROR, &failure, &length);
  if (failure != 0) return make_error(Errc::kDisconnected, "%s: %s", peer, std::strerror(failure));
  return fd;
}

}  // namespace

Result<UniqueFd> tcp_connect(const std::string& host, std::uint16_t port, TimePoint deadline) {
  const std::string service = std::to_string(port);
  const std::string peer = host + ":" + service;
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int code = ::getaddrinfo(host.c_str(), service.c_str(), &hints, &found); code != 0) {
    return make_error(Errc::kNotFound, "cannot resolve host '%s': %s", host.c_str(), ::gai_strerror(code));
  }
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, &::freeaddrinfo);
  return connect_to(found->ai_addr, found->ai_addrlen, peer.c_str(), deadline);
}

Result<UniqueFd> tcp_listen(const std::string& address, std::uint16_t port) {
  sockaddr_in where{};
  where.sin_family = AF_INET;
  where.sin_port = htons(port);
  if (::inet_pton(AF_INET, address.c_str(), &where.sin_addr) != 1) {
    return make_error(Errc::kInvalidArgument, "'%s' is not an IPv4 address", address.c_str());
  }
  UniqueFd fd(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!fd) return make_error(Errc::kIo, "cannot create a socket: %s", std::strerror(errno));
  const int on = 1;
  ::setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  const auto* generic = reinterpret_cast<const sockaddr*>(&where);
  if (::bind(fd.get(), generic, sizeof where) != 0 || ::listen(fd.get(), 16) != 0) {
    return make_error(Errc::kIo, "cannot listen on %s:%u: %s", address.c_str(), unsigned{port}, std::strerror(errno));
  }
  return fd;
}

std::uint16_t local_port(int fd) noexcept {
  sockaddr_in where{};
  socklen_t size = sizeof where;
  if (::getsockname(fd, reinterpret_cast<sockaddr*>(&where), &size) != 0) return 0;
  return ntohs(where.sin_port);
}

UniqueFd tcp_accept(int listener) noexcept {
  UniqueFd fd(::accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (fd) set_no_delay(fd.get());
  return fd;
}

Received receive(int fd, std::span<std::byte> buffer) noexcept {
  const ssize_t size = ::recv(fd, buffer.data(), buffer.size(), MSG_DONTWAIT);
  if (size > 0) return {IoStatus::kDone, static_cast<std::size_t>(size)};
  if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return {IoStatus::kEmpty, 0};
  if (size == 0) errno = 0;
  return {IoStatus::kDisconnected, 0};
}

const char* ending(int error) noexcept {
  switch (error) {
    case 0:
      return "closed the connection";
    case ECONNRESET:
      return "reset the connection; was it restarted?";
    case ETIMEDOUT:
    case EHOSTUNREACH:
    case ENETUNREACH:
    case ENETDOWN:
      return "no longer answers; check the network and its computer";
    default:
      return "broke the connection";
  }
}

IoStatus send_message(int fd, std::span<const std::byte> message) noexcept {
  const ssize_t size = ::send(fd, message.data(), message.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
  if (size == static_cast<ssize_t>(message.size())) return IoStatus::kDone;
  if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return IoStatus::kEmpty;
  return IoStatus::kDisconnected;
}

bool wait_readable(int fd, TimePoint deadline) noexcept {
  return wait_for(fd, POLLIN, deadline);
}

Status send_all(int fd, std::span<const std::byte> message, TimePoint deadline) noexcept {
  while (!message.empty()) {
    const ssize_t size = ::send(fd, message.data(), message.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (size > 0) {
      message = message.subspan(static_cast<std::size_t>(size));
    } else if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) {
      return make_error(Errc::kDisconnected, "the connection is closed: %s", std::strerror(errno));
    } else if (!wait_for(fd, POLLOUT, deadline)) {
      return make_error(Errc::kTimeout, "the peer does not read");
    }
  }
  return {};
}

}  // namespace embody::transport
