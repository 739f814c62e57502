#include "drivers/sim/qtm/ports.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <optional>
#include <string>

#include "drivers/transport/tcp.hpp"
#include "drivers/transport/udp.hpp"

namespace embody::sim {
namespace {

std::string host_name() {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0) return "localhost";
  return name.data();
}

}  // namespace

Status Ports::open(const QtmServerConfig& config) {
  const std::array<std::optional<std::uint16_t>, kCount> wanted{config.port, config.big_endian_port, config.legacy_port,
                                                                config.discovery_port};
  for (std::size_t kind = 0; kind < kCount; ++kind) {
    if (!wanted[kind] || sockets_[kind]) continue;
    const std::uint16_t number = numbers_[kind] != 0 ? numbers_[kind] : *wanted[kind];
    if (Status status = open_one(static_cast<Kind>(kind), config.address, number); !status) {
      close();
      return status;
    }
  }
  return {};
}

Status Ports::open_one(Kind kind, const std::string& address, std::uint16_t number) {
  constexpr int kDiscoveryBuffer = 64 << 10;
  auto socket = kind == kDiscovery ? transport::udp_bind(address, number, kDiscoveryBuffer)
                                   : transport::tcp_listen(address, number);
  if (!socket) return socket.error();
  sockets_[kind] = std::move(*socket);
  numbers_[kind] = transport::local_port(sockets_[kind].get());
  return {};
}

void Ports::close() {
  for (const Kind kind : {kLittleEndian, kBigEndian, kLegacy}) {
    // Somebody may wait for this socket in poll() and so keep it alive: it must not accept any more all the same.
    if (sockets_[kind]) ::shutdown(sockets_[kind].get(), SHUT_RDWR);
    sockets_[kind].reset();
  }
}

transport::UniqueFd Ports::accept(Kind kind) {
  return transport::tcp_accept(sockets_[kind].get());
}

void Ports::answer_discovery(bool allow_remote) {
  constexpr int kMostAtOnce = 16;
  for (int i = 0; i < kMostAtOnce; ++i) {
    std::array<std::byte, 64> buffer{};
    const auto datagram = transport::receive_datagram(sockets_[kDiscovery].get(), buffer);
    if (datagram.status != IoStatus::kDone) return;
    if (datagram.size > buffer.size()) continue;
    const auto port = discovery_reply_port(std::span(buffer).first(datagram.size));
    if (!port || !is_open() || (!allow_remote && datagram.source >> 24 != 127)) continue;
    const auto socket = transport::udp_connect(transport::dotted(datagram.source), *port);
    // The client adds 1 to the base port; a reply that gets lost is asked for again.
    const auto base = static_cast<std::uint16_t>(numbers_[kLittleEndian] - 1);
    const auto reply = discovery_reply(host_name() + ", QTM 2023.3 (build 13590), 7 cameras", base);
    if (socket) (void)transport::send_message(socket->get(), reply);
  }
}

}  // namespace embody::sim
