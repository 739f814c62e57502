#include "drivers/capture/udp_forwarder.hpp"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <vector>

#include "drivers/transport/tcp.hpp"
#include "drivers/transport/udp.hpp"

namespace embody::capture {
namespace {

constexpr int kKernelBuffer_bytes = 1 << 20;

}  // namespace

Status UdpForwarder::open(const std::string& address, std::uint16_t port, std::uint16_t driver_port) {
  auto from = transport::udp_bind(address, port, kKernelBuffer_bytes);
  if (!from) return from.error();
  auto to = transport::udp_connect("127.0.0.1", driver_port);
  if (!to) return to.error();
  from_ = std::move(*from);
  to_ = std::move(*to);
  port_ = transport::local_port(from_.get());
  thread_.start([this] { run(); });
  return {};
}

void UdpForwarder::run() {
  const std::uint32_t connection = writer_.connection(port_);
  std::vector<std::byte> buffer(kMaxChunkBytes);
  while (true) {
    pollfd polled[2] = {{thread_.stop_fd(), POLLIN, 0}, {from_.get(), POLLIN, 0}};
    if (::poll(polled, 2, -1) < 0) continue;  // a signal
    if (polled[0].revents != 0) return;
    for (int i = 0; i < 64; ++i) {
      const auto datagram = transport::receive_datagram(from_.get(), buffer);
      if (datagram.status != IoStatus::kDone) break;
      const std::span<const std::byte> bytes(buffer.data(), std::min(datagram.size, buffer.size()));
      writer_.bytes(connection, Event::kIn, bytes);
      // A driver that is not there yet, or a full buffer, loses the datagram as on any network.
      static_cast<void>(::send(to_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL));
    }
  }
}

}  // namespace embody::capture
