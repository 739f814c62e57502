#include "drivers/sim/ur/rtde_server.hpp"

#include <sys/socket.h>

#include <algorithm>

#include "drivers/transport/tcp.hpp"

namespace embody::sim {
namespace {

/// The real controller's buffers hold seconds; bounded ones close slow readers, and stop a flood of inputs, after a
/// predictable while.
void bound_buffers(int fd) noexcept {
  const int send_bytes = 128 * 1024;
  const int receive_bytes = 32 * 1024;
  ::setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &send_bytes, sizeof send_bytes);
  ::setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof receive_bytes);
}

}  // namespace

Status RtdeServer::listen(const std::string& address, std::uint16_t port) {
  auto listener = transport::tcp_listen(address, port);
  if (!listener) return listener.error();
  listener_ = std::move(*listener);
  return {};
}

std::uint16_t RtdeServer::port() const noexcept {
  return transport::local_port(listener_.get());
}

void RtdeServer::receive(std::size_t max_clients, TimePoint now) {
  constexpr Duration kOneTooMany = std::chrono::seconds(1);
  shared_.now = now;
  while (transport::UniqueFd fd = transport::tcp_accept(listener_.get())) {
    if (sessions_.size() >= 2 * max_clients) continue;
    bound_buffers(fd.get());
    const TimePoint expires = sessions_.size() < max_clients ? TimePoint::max() : now + kOneTooMany;
    sessions_.emplace_back(shared_, std::move(fd), ++shared_.counters.clients_accepted, expires);
  }
  sessions_.remove_if([](RtdeSession& session) { return !session.receive(); });
}

void RtdeServer::publish(std::uint64_t previous, std::uint64_t cycle) {
  sessions_.remove_if([=](RtdeSession& session) { return !session.publish(previous, cycle); });
}

void RtdeServer::disconnect_all(bool by_reset) noexcept {
  for (RtdeSession& session : sessions_) {
    if (by_reset) session.reset_on_close();
  }
  sessions_.clear();
}

void RtdeServer::occupy_registers(bool occupied) {
  // What a fieldbus adapter or a second program of this kind would hold.
  for (int i = 24; i < 48; ++i) {
    for (const char* kind : {"input_int_register_", "input_double_register_"}) {
      std::uint64_t& owner = shared_.owners[shared_.variables.at(kind + std::to_string(i))];
      if (owner == 0 || owner == kForeignOwner) owner = occupied ? kForeignOwner : 0;
    }
  }
}

bool RtdeServer::has_commanding_client() const noexcept {
  return std::any_of(sessions_.begin(), sessions_.end(), [](const RtdeSession& s) { return s.commanding(); });
}

}  // namespace embody::sim
