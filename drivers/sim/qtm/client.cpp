#include "drivers/sim/qtm/client.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <utility>

#include "drivers/transport/tcp.hpp"
#include "drivers/transport/udp.hpp"

namespace embody::sim {
namespace {

constexpr std::size_t kLargestDatagram = 65'507;

std::uint16_t peer_port(int fd) noexcept {
  sockaddr_in peer{};
  socklen_t size = sizeof peer;
  ::getpeername(fd, reinterpret_cast<sockaddr*>(&peer), &size);
  return ntohs(peer.sin_port);
}

}  // namespace

Client::Client(transport::UniqueFd socket, ByteOrder order, std::uint64_t id) : input(order), fd_(std::move(socket)) {
  address_ = transport::dotted(transport::peer_address(fd_.get()));
  conversation.id = id;
  conversation.order = order;
  conversation.peer = address_ + " (" + std::to_string(peer_port(fd_.get())) + ")";
}

void Client::close() {
  dead_ = true;
  ::shutdown(fd_.get(), SHUT_RDWR);
}

void Client::send(const Bytes& packet, const LinkFaults& faults) {
  if (dead_ || faults.silent) return;
  if (transport::send_message(fd_.get(), packet) != IoStatus::kDone) close();
}

void Client::send(const Reply& reply, const LinkFaults& faults) {
  send(string_packet(reply.type, reply.text, conversation.order), faults);
}

void Client::send(QtmEvent event, const LinkFaults& faults) {
  send(event_packet(event, conversation.order), faults);
}

void Client::send_frame(const FrameData& frame, const LinkFaults& faults) {
  const auto& components = conversation.stream->components;
  if (!udp_) return send(encode_frame(frame, components, conversation.order), faults);
  if (!faults.split_udp) return send_datagram(encode_frame(frame, components, conversation.order), faults);
  for (const Component component : components) {
    send_datagram(encode_frame(frame, {&component, 1}, conversation.order), faults);
  }
}

void Client::send_datagram(Bytes packet, const LinkFaults& faults) {
  if (dead_ || faults.silent || packet.size() > kLargestDatagram) return;
  if (faults.reorder_udp && held_.empty()) {
    held_ = std::move(packet);
    return;
  }
  // Lost datagrams are nobody's business: the result of the sending does not matter.
  for (int copy = 0; copy < (faults.duplicate_udp ? 2 : 1); ++copy) (void)transport::send_message(udp_.get(), packet);
  if (held_.empty()) return;
  (void)transport::send_message(udp_.get(), std::exchange(held_, {}));
}

Status Client::open_stream(bool anywhere) {
  udp_.reset();
  held_.clear();
  if (!conversation.stream || !conversation.stream->udp) return {};
  const UdpTarget& target = *conversation.stream->udp;
  const std::string address = target.address.empty() ? address_ : target.address;
  in_addr where{};
  const bool numeric = ::inet_pton(AF_INET, address.c_str(), &where) == 1;
  constexpr std::uint32_t kLoopbackNetwork = 127;
  if (!numeric || (!anywhere && ntohl(where.s_addr) >> 24 != kLoopbackNetwork)) {
    return make_error(Errc::kRefused, "UDP address '%.60s' not allowed", address.c_str());
  }
  auto socket = transport::udp_connect(address, target.port);
  if (!socket) return socket.error();
  udp_ = std::move(*socket);
  return {};
}

}  // namespace embody::sim
