// The source filter on plain UDP sockets: loopback owns 127.0.0.0/8, so a sender can choose its address without rights.
#include "daemon/dds/source_filter.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <random>

namespace embody::dds {
namespace {

class Socket {
 public:
  explicit Socket(const char* address) : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in in{};
    in.sin_family = AF_INET;
    ::inet_pton(AF_INET, address, &in.sin_addr);
    bound_ = ::bind(fd_, reinterpret_cast<const sockaddr*>(&in), sizeof in) == 0;
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket() { ::close(fd_); }
  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] bool bound() const { return bound_; }
  [[nodiscard]] sockaddr_in address() const {
    sockaddr_in in{};
    socklen_t size = sizeof in;
    ::getsockname(fd_, reinterpret_cast<sockaddr*>(&in), &size);
    return in;
  }

 private:
  int fd_;
  bool bound_{false};
};

/// True when a datagram from `source` reaches `receiver`. Loopback delivers within the call of sendto.
bool reaches(const Socket& receiver, const char* source) {
  const Socket sender(source);
  const sockaddr_in to = receiver.address();
  char byte = 'x';
  EXPECT_TRUE(sender.bound());
  EXPECT_EQ(::sendto(sender.fd(), &byte, 1, 0, reinterpret_cast<const sockaddr*>(&to), sizeof to), 1);
  pollfd wait{receiver.fd(), POLLIN, 0};
  return ::poll(&wait, 1, 50) == 1 && ::recv(receiver.fd(), &byte, 1, MSG_DONTWAIT) == 1;
}

std::string text_of(std::uint32_t address) {
  return std::to_string(address >> 24) + "." + std::to_string(address >> 16 & 255) + "." +
         std::to_string(address >> 8 & 255) + "." + std::to_string(address & 255);
}

TEST(ParseNetwork, ReadsBackEveryNetworkThatItsTextNames) {
  std::mt19937 generator(3);
  for (unsigned length = 0; length <= 32; ++length) {
    const std::uint32_t mask = length == 0 ? 0 : ~0U << (32 - length);
    const Network expected{static_cast<std::uint32_t>(generator()) & mask, mask};
    const auto network = parse_network(text_of(expected.address) + "/" + std::to_string(length));
    ASSERT_TRUE(network) << network.error().detail.c_str();
    EXPECT_EQ(*network, expected);
  }
  EXPECT_EQ(*parse_network("10.1.2.3"), (Network{0x0a010203, 0xffffffff}));
}

TEST(ParseNetwork, RefusesEverythingElse) {
  for (const char* text : {"", "/8", "10", "10.0.0.0/33", "10.0.0.0/-1", "10.0.0.0/", "10.0.0.0/8 ", "10.0.0.1/8",
                           "256.0.0.0/8", "::1/128", "10.0.0.0/8/8", "lab"})
    EXPECT_FALSE(parse_network(text)) << text;
  EXPECT_FALSE(parse_network(std::string_view("10.0.0.0\0x/8", 12)));
  EXPECT_FALSE(parse_network(std::string(100'000, '1')));
}

TEST(AcceptOnly, LetsInTheNamedNetworksAndNobodyElse) {
  const Socket receiver("127.0.0.1");
  const std::vector<Network> networks{*parse_network("127.1.0.0/16"), *parse_network("127.2.0.7")};
  EXPECT_TRUE(reaches(receiver, "127.0.0.1")) << "without a filter";
  const Status attached = accept_only(receiver.fd(), networks);
  ASSERT_TRUE(attached) << attached.error().detail.c_str();
  EXPECT_TRUE(reaches(receiver, "127.1.0.1"));
  EXPECT_TRUE(reaches(receiver, "127.1.255.254"));
  EXPECT_TRUE(reaches(receiver, "127.2.0.7"));
  EXPECT_FALSE(reaches(receiver, "127.0.0.1"));
  EXPECT_FALSE(reaches(receiver, "127.2.0.8"));
  EXPECT_FALSE(reaches(receiver, "127.0.255.255"));
}

TEST(AcceptOnly, TakesSixteenNetworksAndChecksTheLast) {
  const Socket receiver("127.0.0.1");
  std::vector<Network> networks(kMaxNetworks - 1, *parse_network("10.0.0.0/8"));
  networks.push_back(*parse_network("127.0.0.9"));
  ASSERT_TRUE(accept_only(receiver.fd(), networks));
  EXPECT_TRUE(reaches(receiver, "127.0.0.9"));
  EXPECT_FALSE(reaches(receiver, "127.0.0.8"));
}

TEST(AcceptOnly, RefusesNoNetworkTooManyAndWhatIsNoSocket) {
  const Socket receiver("127.0.0.1");
  EXPECT_FALSE(accept_only(receiver.fd(), {}));
  EXPECT_FALSE(accept_only(receiver.fd(), std::vector<Network>(kMaxNetworks + 1)));
  EXPECT_FALSE(accept_only(-1, std::vector<Network>(1)));
  EXPECT_TRUE(reaches(receiver, "127.0.0.1"));
}

TEST(AcceptOnly, CannotBeUndone) {
  const Socket receiver("127.0.0.1");
  ASSERT_TRUE(accept_only(receiver.fd(), std::vector<Network>{*parse_network("127.0.0.9")}));
  const int unused = 0;
  EXPECT_NE(::setsockopt(receiver.fd(), SOL_SOCKET, SO_DETACH_FILTER, &unused, sizeof unused), 0);
  EXPECT_FALSE(reaches(receiver, "127.0.0.1"));
}

TEST(UdpSockets, ListsExactlyTheUdpSocketsThatAreOpen) {
  const auto before = udp_sockets();
  ASSERT_TRUE(before);
  const Socket one("127.0.0.1"), two("127.0.0.1");
  const int tcp = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int local = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const auto after = udp_sockets();
  ::close(tcp);
  ::close(local);
  ASSERT_TRUE(after);
  EXPECT_EQ(after->size(), before->size() + 2);
  for (int fd : {one.fd(), two.fd()})
    EXPECT_TRUE(std::any_of(after->begin(), after->end(), [fd](const UdpSocket& s) { return s.fd == fd; }));
}

TEST(NetworksOf, TheLoopbackIsItselfAndAnUnknownInterfaceIsAnError) {
  const auto networks = networks_of("lo");
  ASSERT_TRUE(networks) << networks.error().detail.c_str();
  EXPECT_EQ(*networks, std::vector<Network>{*parse_network("127.0.0.0/8")});
  EXPECT_FALSE(networks_of("no-such-if"));
}

}  // namespace
}  // namespace embody::dds
