#include "drivers/transport/udp.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

namespace embody::transport {
namespace {

constexpr Network kLoopback{0x7f000000, 0xff000000};

Result<sockaddr_in> parse(const std::string& address, std::uint16_t port) {
  sockaddr_in where{};
  where.sin_family = AF_INET;
  where.sin_port = htons(port);
  if (::inet_pton(AF_INET, address.c_str(), &where.sin_addr) == 1) return where;
  return make_error(Errc::kInvalidArgument, "'%.60s' is not an IPv4 address", address.c_str());
}

Result<UniqueFd> open_socket() {
  UniqueFd fd(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!fd) return make_error(Errc::kIo, "cannot create a socket: %s", std::strerror(errno));
  return fd;
}

std::uint32_t ipv4(const sockaddr* address) noexcept {
  sockaddr_in in{};
  std::memcpy(&in, address, sizeof in);
  return ntohl(in.sin_addr.s_addr);
}

}  // namespace

Result<Network> network_of(const std::string& address) {
  const auto where = parse(address, 0);
  if (!where) return where.error();
  const std::uint32_t own = ntohl(where->sin_addr.s_addr);
  if (own == INADDR_ANY) {
    return make_error(Errc::kInvalidArgument, "'%s' means every interface; give the address of one", address.c_str());
  }
  if (kLoopback.contains(own)) return kLoopback;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return make_error(Errc::kIo, "cannot list the interfaces: %s", std::strerror(errno));
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(list, &::freeifaddrs);
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET || entry->ifa_netmask == nullptr) continue;
    if (ipv4(entry->ifa_addr) == own) return Network{own, ipv4(entry->ifa_netmask)};
  }
  return make_error(Errc::kNotFound, "no interface of this computer has the address %s", address.c_str());
}

Result<UniqueFd> udp_bind(const std::string& address, std::uint16_t port, int buffer_bytes) {
  const auto where = parse(address, port);
  if (!where) return where.error();
  auto fd = open_socket();
  if (!fd) return fd.error();
  ::setsockopt(fd->get(), SOL_SOCKET, SO_RCVBUF, &buffer_bytes, sizeof buffer_bytes);
  if (::bind(fd->get(), reinterpret_cast<const sockaddr*>(&*where), sizeof *where) != 0) {
    return make_error(Errc::kIo, "cannot receive at UDP %s:%u: %s", address.c_str(), unsigned{port},
                      std::strerror(errno));
  }
  return fd;
}

Result<UniqueFd> udp_connect(const std::string& address, std::uint16_t port) {
  const auto where = parse(address, port);
  if (!where) return where.error();
  auto fd = open_socket();
  if (!fd) return fd.error();
  if (::connect(fd->get(), reinterpret_cast<const sockaddr*>(&*where), sizeof *where) != 0) {
    return make_error(Errc::kIo, "cannot send to UDP %s:%u: %s", address.c_str(), unsigned{port}, std::strerror(errno));
  }
  return fd;
}

Datagram receive_datagram(int fd, std::span<std::byte> buffer) noexcept {
  sockaddr_in from{};
  socklen_t from_size = sizeof from;
  const ssize_t size = ::recvfrom(fd, buffer.data(), buffer.size(), MSG_DONTWAIT | MSG_TRUNC,
                                  reinterpret_cast<sockaddr*>(&from), &from_size);
  if (size >= 0) return {IoStatus::kDone, static_cast<std::size_t>(size), ntohl(from.sin_addr.s_addr)};
  if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) return {};
  return {IoStatus::kDisconnected, 0, 0};
}

std::vector<std::string> interface_addresses() {
  std::vector<std::string> addresses;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return addresses;
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(list, &::freeifaddrs);
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET || (entry->ifa_flags & IFF_UP) == 0) {
      continue;
    }
    addresses.push_back(dotted(ipv4(entry->ifa_addr)));
  }
  return addresses;
}

Result<std::string> broadcast_address(const std::string& address) {
  const auto network = network_of(address);
  if (!network) return network.error();
  if (network->address == kLoopback.address && network->mask == kLoopback.mask) return address;
  return dotted(network->address | ~network->mask);
}

Status send_datagram(int fd, const std::string& address, std::uint16_t port, std::span<const std::byte> datagram) {
  const auto where = parse(address, port);
  if (!where) return where.error();
  const int on = 1;
  ::setsockopt(fd, SOL_SOCKET, SO_BROADCAST, &on, sizeof on);
  const ssize_t size = ::sendto(fd, datagram.data(), datagram.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                                reinterpret_cast<const sockaddr*>(&*where), sizeof *where);
  if (size == static_cast<ssize_t>(datagram.size())) return {};
  return make_error(Errc::kIo, "cannot send to UDP %s:%u: %s", address.c_str(), unsigned{port}, std::strerror(errno));
}

std::uint32_t own_address(int fd) noexcept {
  sockaddr_in where{};
  socklen_t size = sizeof where;
  return ::getsockname(fd, reinterpret_cast<sockaddr*>(&where), &size) == 0 ? ntohl(where.sin_addr.s_addr) : 0;
}

std::uint32_t peer_address(int fd) noexcept {
  sockaddr_in where{};
  socklen_t size = sizeof where;
  return ::getpeername(fd, reinterpret_cast<sockaddr*>(&where), &size) == 0 ? ntohl(where.sin_addr.s_addr) : 0;
}

std::string dotted(std::uint32_t address) {
  char text[16];
  std::snprintf(text, sizeof text, "%u.%u.%u.%u", address >> 24, (address >> 16) & 0xff, (address >> 8) & 0xff,
                address & 0xff);
  return text;
}

}  // namespace embody::transport
