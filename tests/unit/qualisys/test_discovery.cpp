#include <gtest/gtest.h>
#include <poll.h>

#include <random>
#include <thread>

#include "drivers/qualisys/codec.hpp"
#include "drivers/qualisys/discovery.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/transport/udp.hpp"
#include "tests/unit/qualisys/support.hpp"

namespace embody::qualisys {
namespace {

using std::chrono::milliseconds;
using test::Bytes;

Bytes reply_of(std::string_view info, std::uint16_t base_port) {
  Bytes bytes;
  append(bytes, static_cast<std::uint32_t>(8 + info.size() + 1 + 2), ByteOrder::kLittle);
  append(bytes, 1U, ByteOrder::kLittle);
  for (const char c : info) bytes.push_back(static_cast<std::byte>(c));
  bytes.push_back(std::byte{0});
  append(bytes, base_port, ByteOrder::kBig);
  return bytes;
}

TEST(Discovery, AsksAsDocumented) {
  const unsigned documented[] = {0x0a, 0, 0, 0, 0x07, 0, 0, 0, 0x11, 0xb6};
  const auto request = encode_discovery_request(4534);
  for (std::size_t i = 0; i < request.size(); ++i) EXPECT_EQ(std::to_integer<unsigned>(request[i]), documented[i]);
}

TEST(Discovery, ReadsWhatQtmAnswers) {
  const auto reply = decode_discovery_reply(reply_of("LAB-PC, QTM 2023.3 (build 13590), 7 cameras", 22222));
  ASSERT_TRUE(reply.ok()) << reply.error().detail.c_str();
  EXPECT_EQ(reply->info, "LAB-PC, QTM 2023.3 (build 13590), 7 cameras");
  EXPECT_EQ(reply->base_port, 22222);
  EXPECT_EQ(decode_discovery_reply(reply_of("a\x1b[2J\xff", 1))->info, "a?[2J?") << "nothing that moves a terminal";
}

TEST(Discovery, RefusesEveryTruncationAndWhatContradictsItself) {
  const auto whole = reply_of("LAB-PC", 22222);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(decode_discovery_reply(std::span(whole).first(size)).ok()) << size;
  }
  for (const std::uint16_t port : {std::uint16_t{0}, std::uint16_t{65534}, std::uint16_t{65535}})
    EXPECT_FALSE(decode_discovery_reply(reply_of("LAB", port)).ok());
  auto unterminated = whole;
  unterminated[whole.size() - 3] = std::byte{'!'};
  EXPECT_FALSE(decode_discovery_reply(unterminated).ok());
  auto early = whole;
  early[9] = std::byte{0};
  EXPECT_FALSE(decode_discovery_reply(early).ok());
  auto other_type = whole;
  other_type[4] = std::byte{7};
  EXPECT_FALSE(decode_discovery_reply(other_type).ok());
}

/// Answers each request with `replies`, sent to the port that the request names.
class Responder {
 public:
  explicit Responder(std::vector<Bytes> replies) : socket_(transport::udp_bind("127.0.0.1", 0, 1 << 16).value()) {
    port_ = transport::local_port(socket_.get());
    thread_ = std::thread([this, replies = std::move(replies)] {
      std::array<std::byte, 64> buffer;
      while (!stop_) {
        if (!transport::wait_readable(socket_.get(), std::chrono::steady_clock::now() + milliseconds(20))) continue;
        const auto request = transport::receive_datagram(socket_.get(), buffer);
        if (request.status != IoStatus::kDone || request.size != 10) continue;
        const auto port = load<std::uint16_t>(buffer, 8, ByteOrder::kBig);
        for (const auto& reply : replies) {
          (void)transport::send_datagram(socket_.get(), transport::dotted(request.source), port, reply);
        }
      }
    });
  }
  ~Responder() {
    stop_ = true;
    thread_.join();
  }
  [[nodiscard]] std::uint16_t port() const { return port_; }

 private:
  transport::UniqueFd socket_;
  std::uint16_t port_{0};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

TEST(Discovery, ListsEachQtmOnceAndLeavesOutNoise) {
  const Responder responder({reply_of("A", 22222), Bytes(3), reply_of("A", 22222), reply_of("B", 30000), Bytes(1400)});
  const auto hosts = discover({"127.0.0.1"}, milliseconds(500), responder.port());
  ASSERT_TRUE(hosts.ok()) << hosts.error().detail.c_str();
  ASSERT_EQ(hosts->size(), 2U);
  EXPECT_EQ((*hosts)[0].address, "127.0.0.1");
  EXPECT_EQ((*hosts)[0].reply.info, "A");
  EXPECT_EQ((*hosts)[1].reply.base_port, 30000);
}

TEST(Discovery, FindsNobodyInBoundedTime) {
  const auto free_port = [] {
    const auto socket = transport::udp_bind("127.0.0.1", 0, 4096);
    return transport::local_port(socket->get());
  }();
  const auto hosts = discover({"127.0.0.1"}, milliseconds(100), free_port);
  ASSERT_TRUE(hosts.ok());
  EXPECT_TRUE(hosts->empty());
}

TEST(Discovery, SaysWhichAddressIsNotOurs) {
  EXPECT_FALSE(discover({}, milliseconds(10)).ok());
  for (const char* address : {"203.0.113.7", "0.0.0.0", "nonsense"}) {
    const auto hosts = discover({address}, milliseconds(10));
    ASSERT_FALSE(hosts.ok()) << address;
    EXPECT_NE(hosts.error().detail.view().find(address), std::string_view::npos) << hosts.error().detail.view();
  }
  EXPECT_TRUE(discover({"203.0.113.7", "127.0.0.1"}, milliseconds(10)).ok()) << "one network that works is enough";
}

TEST(Discovery, KnowsTheAddressesOfThisComputer) {
  const auto addresses = transport::interface_addresses();
  EXPECT_NE(std::find(addresses.begin(), addresses.end(), "127.0.0.1"), addresses.end());
  for (const auto& address : addresses) EXPECT_TRUE(transport::broadcast_address(address).ok()) << address;
}

}  // namespace
}  // namespace embody::qualisys
