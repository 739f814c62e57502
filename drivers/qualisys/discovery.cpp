#include "drivers/qualisys/discovery.hpp"

#include <poll.h>

#include <algorithm>

#include "drivers/qualisys/codec.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/transport/udp.hpp"

namespace embody::qualisys {
namespace {

constexpr std::size_t kMaxReply = 1500;
constexpr std::size_t kMaxHosts = 64;
constexpr int kUdpBuffer = 256 << 10;  // bytes

struct Asker {
  std::string local_address;
  transport::UniqueFd fd;
};

Result<Asker> ask(const std::string& local_address, std::uint16_t port) {
  const auto everybody = transport::broadcast_address(local_address);
  if (!everybody) return everybody.error();
  auto fd = transport::udp_bind(local_address, 0, kUdpBuffer);
  if (!fd) return fd.error();
  const auto request = encode_discovery_request(transport::local_port(fd->get()));
  if (const auto status = transport::send_datagram(fd->get(), *everybody, port, request); !status) {
    return status.error();
  }
  return Asker{local_address, std::move(*fd)};
}

void collect(const Asker& asker, std::vector<QtmHost>& hosts) {
  std::array<std::byte, kMaxReply> buffer;
  while (true) {
    const auto received = transport::receive_datagram(asker.fd.get(), buffer);
    if (received.status != IoStatus::kDone) return;
    if (received.size > buffer.size()) continue;
    auto reply = decode_discovery_reply(std::span<const std::byte>(buffer).first(received.size));
    if (!reply || hosts.size() == kMaxHosts) continue;
    QtmHost host{transport::dotted(received.source), asker.local_address, std::move(*reply)};
    const auto same = [&](const QtmHost& other) {
      return other.address == host.address && other.reply.base_port == host.reply.base_port;
    };
    if (std::none_of(hosts.begin(), hosts.end(), same)) hosts.push_back(std::move(host));
  }
}

}  // namespace

std::array<std::byte, 10> encode_discovery_request(std::uint16_t reply_port) noexcept {
  std::array<std::byte, 10> request{};
  request[0] = std::byte{10};
  request[4] = static_cast<std::byte>(PacketType::kDiscover);
  request[8] = static_cast<std::byte>(reply_port >> 8);
  request[9] = static_cast<std::byte>(reply_port & 0xFF);
  return request;
}

Result<DiscoveryReply> decode_discovery_reply(std::span<const std::byte> datagram) {
  const auto header = decode_whole(datagram);
  if (!header) return header.error();
  if (header->type != PacketType::kCommand || header->size < kHeaderSize + 3) {
    return make_error(Errc::kMalformed, "a discovery reply of type %u and %zu bytes",
                      static_cast<unsigned>(header->type), header->size);
  }
  const auto text = datagram.subspan(kHeaderSize, datagram.size() - kHeaderSize - 2);
  const auto end = std::find(text.begin(), text.end(), std::byte{0});
  if (end != text.end() - 1) {
    return make_error(Errc::kMalformed, "the text of a discovery reply does not end in front of its port");
  }
  DiscoveryReply reply;
  for (auto c = text.begin(); c != end; ++c) {
    const auto letter = std::to_integer<char>(*c);
    reply.info.push_back(letter < ' ' || letter > '~' ? '?' : letter);
  }
  reply.base_port = load<std::uint16_t>(datagram, datagram.size() - 2, ByteOrder::kBig);
  if (reply.base_port > 0 && reply.base_port <= 65'533) return reply;
  return make_error(Errc::kMalformed, "a discovery reply with base port %u", unsigned{reply.base_port});
}

Result<std::vector<QtmHost>> discover(const std::vector<std::string>& local_addresses, Duration timeout,
                                      std::uint16_t port) {
  if (local_addresses.empty()) return make_error(Errc::kInvalidArgument, "there is no network to look for QTM in");
  const TimePoint deadline = transport::now() + timeout;
  std::vector<Asker> askers;
  std::vector<pollfd> polled;
  Error last;
  for (const auto& address : local_addresses) {
    auto asker = ask(address, port);
    if (!asker) {
      last = asker.error();
      continue;
    }
    polled.push_back({asker->fd.get(), POLLIN, 0});
    askers.push_back(std::move(*asker));
  }
  if (askers.empty()) return last;
  std::vector<QtmHost> hosts;
  while (true) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - transport::now()).count();
    if (left <= 0) return hosts;
    ::poll(polled.data(), polled.size(), static_cast<int>(std::min<std::int64_t>(left, 1000)));
    for (const auto& asker : askers) collect(asker, hosts);
  }
}

}  // namespace embody::qualisys
