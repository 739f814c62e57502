#include "daemon/dds/source_filter.hpp"

#include <arpa/inet.h>
#include <dirent.h>
#include <ifaddrs.h>
#include <linux/filter.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>

namespace embody::dds {
namespace {

constexpr Network kLoopback{0x7f000000, 0xff000000};
constexpr std::uint32_t kSourceAddressOffset = 12;  // in the IPv4 header, RFC 791 section 3.1

std::uint32_t prefix_mask(unsigned length) {
  return length == 0 ? 0 : ~std::uint32_t{0} << (32 - length);
}

template <class T>
bool parse_number(std::string_view text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size();
}

std::uint32_t host_order(const sockaddr* address) {
  sockaddr_in in{};
  std::memcpy(&in, address, sizeof in);
  return ntohl(in.sin_addr.s_addr);
}

bool is_udp(int fd) {
  const auto option = [fd](int name) {
    int value = -1;
    socklen_t size = sizeof value;
    return ::getsockopt(fd, SOL_SOCKET, name, &value, &size) == 0 ? value : -1;
  };
  const int family = option(SO_DOMAIN);
  return (family == AF_INET || family == AF_INET6) && option(SO_TYPE) == SOCK_DGRAM &&
         option(SO_PROTOCOL) == IPPROTO_UDP;
}

}  // namespace

Result<Network> parse_network(std::string_view text) {
  const auto bad = [text](const char* why) {
    return make_error(Errc::kInvalidArgument, "'%.40s' is not an IPv4 network such as 192.168.1.0/24: %s",
                      std::string(text.substr(0, 40)).c_str(), why);
  };
  const std::size_t slash = text.find('/');
  const std::string address(text.substr(0, slash));
  in_addr parsed{};
  if (::inet_pton(AF_INET, address.c_str(), &parsed) != 1 || address.size() != std::strlen(address.c_str()))
    return bad("no dotted address");
  unsigned length = 32;
  if (slash != std::string_view::npos && (!parse_number(text.substr(slash + 1), length) || length > 32))
    return bad("the prefix length is not 0 to 32");
  const Network network{ntohl(parsed.s_addr), prefix_mask(length)};
  if ((network.address & ~network.mask) != 0) return bad("address bits after the prefix must be 0");
  return network;
}

Result<std::vector<Network>> networks_of(const std::string& interface) {
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0)
    return make_error(Errc::kIo, "cannot list the network interfaces: %s", std::strerror(errno));
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(list, &::freeifaddrs);
  std::vector<Network> networks{kLoopback};
  bool exists = false, has_address = false;
  for (const ifaddrs* i = list; i != nullptr; i = i->ifa_next) {
    if (interface != i->ifa_name) continue;
    exists = true;
    if (i->ifa_addr == nullptr || i->ifa_addr->sa_family != AF_INET || i->ifa_netmask == nullptr) continue;
    has_address = true;
    if ((i->ifa_flags & IFF_LOOPBACK) != 0 || networks.size() == kMaxNetworks) continue;
    const std::uint32_t mask = host_order(i->ifa_netmask);
    networks.push_back({host_order(i->ifa_addr) & mask, mask});
  }
  if (!exists)
    return make_error(Errc::kNotFound, "there is no network interface '%.15s'; 'ip link' lists them",
                      interface.c_str());
  if (!has_address)
    return make_error(Errc::kNotFound, "network interface '%.15s' has no IPv4 address; give it one or choose another",
                      interface.c_str());
  return networks;
}

Result<std::vector<UdpSocket>> udp_sockets() {
  const std::unique_ptr<DIR, int (*)(DIR*)> folder(::opendir("/proc/self/fd"), &::closedir);
  if (!folder) return make_error(Errc::kIo, "cannot read /proc/self/fd: %s", std::strerror(errno));
  std::vector<UdpSocket> sockets;
  while (const dirent* entry = ::readdir(folder.get())) {
    int fd = -1;
    struct stat info {};
    if (parse_number(entry->d_name, fd) && ::fstat(fd, &info) == 0 && S_ISSOCK(info.st_mode) && is_udp(fd))
      sockets.push_back({fd, info.st_ino});
  }
  return sockets;
}

Status accept_only(int fd, std::span<const Network> networks) {
  if (networks.empty() || networks.size() > kMaxNetworks)
    return make_error(Errc::kInvalidArgument, "a source filter takes 1 to %zu networks, not %zu", kMaxNetworks,
                      networks.size());
  // The filter of a UDP socket sees the datagram from its UDP header on; SKF_NET_OFF reaches back to the IP header.
  std::vector<sock_filter> program;
  for (const Network& n : networks) {
    program.push_back(
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(SKF_NET_OFF) + kSourceAddressOffset));
    program.push_back(BPF_STMT(BPF_ALU | BPF_AND | BPF_K, n.mask));
    program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, n.address, 0, 1));
    program.push_back(BPF_STMT(BPF_RET | BPF_K, 0xffffffff));  // keep the whole datagram
  }
  program.push_back(BPF_STMT(BPF_RET | BPF_K, 0));  // drop
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  const int on = 1;
  if (::setsockopt(fd, SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof filter) != 0 ||
      ::setsockopt(fd, SOL_SOCKET, SO_LOCK_FILTER, &on, sizeof on) != 0)
    return make_error(Errc::kIo, "cannot attach the source filter to UDP socket %d: %s", fd, std::strerror(errno));
  return {};
}

}  // namespace embody::dds
