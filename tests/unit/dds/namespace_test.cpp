// Datagrams from another machine, played by a network namespace behind a veth pair, never reach the publisher although
// its sockets are bound to 0.0.0.0. Needs the right to create network namespaces.
#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <poll.h>
#include <sched.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstdlib>
#include <thread>

#include "embody_msgs.h"
#include "tests/unit/dds/dds_test_support.hpp"

namespace embody::dds {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kDatagrams = 5;

/// A network namespace joined to ours: our end has the address .1, the other .2. The destructor removes all.
class Neighbour {
 public:
  Neighbour() {
    ok_ = run("ip netns add " + name_) && run("ip link add " + veth_ + " type veth peer name peer netns " + name_) &&
          run("ip addr add " + address(1) + "/24 dev " + veth_) && run("ip link set " + veth_ + " up") &&
          run("ip -n " + name_ + " addr add " + address(2) + "/24 dev peer") &&
          run("ip -n " + name_ + " link set peer up");
  }
  Neighbour(const Neighbour&) = delete;
  Neighbour& operator=(const Neighbour&) = delete;
  ~Neighbour() {
    run("ip link del " + veth_);
    run("ip netns del " + name_);
  }
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] const std::string& interface() const { return veth_; }

  /// Address `host` of the joined network, which differs between test processes.
  [[nodiscard]] static std::string address(int host) {
    return "10.213." + std::to_string(::getpid() % 256) + "." + std::to_string(host);
  }
  /// A UDP socket that lives in the namespace, or -1. Only the helper thread enters it.
  [[nodiscard]] int udp_socket() const {
    int fd = -1;
    std::thread([&] {
      const int ns = ::open(("/run/netns/" + name_).c_str(), O_RDONLY | O_CLOEXEC);
      if (::setns(ns, CLONE_NEWNET) == 0) fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
      ::close(ns);
    }).join();
    return fd;
  }

 private:
  static bool run(const std::string& command) { return std::system((command + " >/dev/null 2>&1").c_str()) == 0; }

  std::string veth_{"embody" + std::to_string(::getpid() % 100'000)};
  std::string name_{veth_ + "-test"};
  bool ok_{false};
};

sockaddr_in address_of(int fd) {
  sockaddr_in in{};
  socklen_t size = sizeof in;
  ::getsockname(fd, reinterpret_cast<sockaddr*>(&in), &size);
  return in;
}

/// Datagrams that the kernel dropped at this socket so far.
std::uint32_t drops(int fd) {
  std::array<std::uint32_t, SK_MEMINFO_VARS> info{};
  socklen_t size = sizeof info;
  EXPECT_EQ(::getsockopt(fd, SOL_SOCKET, SO_MEMINFO, info.data(), &size), 0);
  return info[SK_MEMINFO_DROPS];
}

/// Waits up to two seconds until the kernel has dropped `expected` datagrams at `fd`; returns what it has dropped.
std::uint32_t drops_when(int fd, std::uint32_t expected) {
  const auto deadline = Clock::now() + std::chrono::seconds(2);
  while (drops(fd) < expected && Clock::now() < deadline) std::this_thread::yield();
  return drops(fd);
}

/// Sends the RTPS header (magic, version 2.1, a foreign vendor and GUID prefix) and nothing after it.
void send_rtps(int from, const char* address, std::uint16_t port_big_endian) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = port_big_endian;
  ::inet_pton(AF_INET, address, &to.sin_addr);
  const std::array<char, 20> header{'R', 'T', 'P', 'S', 2, 1, 1, 15, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
  for (int i = 0; i < kDatagrams; ++i) {
    const auto sent =
        ::sendto(from, header.data(), header.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
    EXPECT_EQ(sent, static_cast<ssize_t>(header.size())) << address;
  }
}

TEST(DdsIsolation, DatagramsFromAnotherMachineAreDroppedAndLoopbackOnesAreNot) {
  const auto before = udp_sockets();
  ASSERT_TRUE(before);
  auto publisher = DdsPublisher::create(test::private_config());
  ASSERT_TRUE(publisher) << publisher.error().detail.c_str();
  const Neighbour neighbour;
  if (!neighbour.ok()) GTEST_SKIP() << "'ip netns add' is not permitted here: run as root with iproute2 installed";
  const int outside = neighbour.udp_socket();
  const int inside = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ASSERT_GE(outside, 0);
  const auto during = udp_sockets();
  std::size_t checked = 0;
  for (const UdpSocket& s : *during) {
    const auto is_s = [&s](const UdpSocket& other) { return other == s; };
    if (s.fd == inside || s.fd == outside || std::any_of(before->begin(), before->end(), is_s)) continue;
    const sockaddr_in own = address_of(s.fd);
    if (own.sin_addr.s_addr != htonl(INADDR_ANY)) continue;  // cannot be reached from outside anyway
    ++checked;
    const std::uint32_t start = drops(s.fd);
    send_rtps(inside, "127.0.0.1", own.sin_port);
    EXPECT_EQ(drops(s.fd), start) << "loopback, port " << ntohs(own.sin_port);
    send_rtps(outside, Neighbour::address(1).c_str(), own.sin_port);
    EXPECT_EQ(drops_when(s.fd, start + kDatagrams), start + kDatagrams) << "port " << ntohs(own.sin_port);
  }
  ::close(inside);
  ::close(outside);
  EXPECT_GE(checked, 2U) << "sockets bound to 0.0.0.0";
  test::Reader<embody_msgs_msg_dds__Status_> reader(embody_msgs_msg_dds__Status__desc, "rt/embody/status");
  EXPECT_TRUE(publisher->publish_status({}));
  EXPECT_NE(reader.next(), nullptr) << "the publisher no longer works";
}

TEST(DdsIsolation, TheNetworksOfAnInterfaceLetItsNeighboursIn) {
  const Neighbour neighbour;
  if (!neighbour.ok()) GTEST_SKIP() << "'ip netns add' is not permitted here: run as root with iproute2 installed";
  const auto networks = networks_of(neighbour.interface());
  ASSERT_TRUE(networks) << networks.error().detail.c_str();
  EXPECT_EQ(*networks,
            (std::vector<Network>{*parse_network("127.0.0.0/8"), *parse_network(Neighbour::address(0) + "/24")}));
  const int outside = neighbour.udp_socket();
  const int receiver = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ASSERT_GE(outside, 0);
  sockaddr_in any{};
  any.sin_family = AF_INET;
  ASSERT_EQ(::bind(receiver, reinterpret_cast<const sockaddr*>(&any), sizeof any), 0);
  ASSERT_TRUE(accept_only(receiver, *networks));
  send_rtps(outside, Neighbour::address(1).c_str(), address_of(receiver).sin_port);
  pollfd wait{receiver, POLLIN, 0};
  EXPECT_EQ(::poll(&wait, 1, 2000), 1);
  ::close(receiver);
  ::close(outside);
}

}  // namespace
}  // namespace embody::dds
