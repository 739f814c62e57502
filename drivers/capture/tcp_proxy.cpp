#include "drivers/capture/tcp_proxy.hpp"

#include <netdb.h>
#include <sys/socket.h>

#include <cstring>

#include "drivers/capture/tcp_link.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::capture {
namespace {

constexpr std::size_t kMaxLinks = 64;

Result<sockaddr_in> resolve(const std::string& host, std::uint16_t port) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int code = ::getaddrinfo(host.c_str(), nullptr, &hints, &found); code != 0) {
    return make_error(Errc::kNotFound, "cannot resolve host '%.100s': %s", host.c_str(), ::gai_strerror(code));
  }
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, &::freeaddrinfo);
  sockaddr_in address{};
  std::memcpy(&address, found->ai_addr, sizeof address);
  address.sin_port = htons(port);
  return address;
}

}  // namespace

TcpProxy::TcpProxy(CaptureWriter& writer) : writer_(writer) {}
TcpProxy::~TcpProxy() {
  stop();
}

Status TcpProxy::forward(const std::string& host, std::uint16_t port, const std::string& listen_address,
                         std::uint16_t listen_port) {
  const auto device = resolve(host, port);
  if (!device) return device.error();
  auto listener = transport::tcp_listen(listen_address, listen_port);
  if (!listener) return listener.error();
  forwards_.push_back({std::move(*listener), *device, port});
  return {};
}

void TcpProxy::start() {
  thread_.start([this] { run(); });
}

std::uint16_t TcpProxy::port_for(std::uint16_t device_port) const noexcept {
  for (const Forward& forward : forwards_) {
    if (forward.port == device_port) return transport::local_port(forward.listener.get());
  }
  return 0;
}

void TcpProxy::run() {
  std::vector<pollfd> polled;
  while (true) {
    polled.assign(1, {thread_.stop_fd(), POLLIN, 0});
    for (const Forward& forward : forwards_) polled.push_back({forward.listener.get(), POLLIN, 0});
    const std::size_t first_link = polled.size();
    for (const Link& link : links_) {
      const auto both = link.interest();
      polled.insert(polled.end(), both.begin(), both.end());
    }
    if (::poll(polled.data(), polled.size(), -1) < 0) continue;  // a signal
    if (polled[0].revents != 0) break;
    std::size_t at = first_link;
    for (Link& link : links_) {
      link.serve(polled[at], polled[at + 1]);
      at += 2;
    }
    links_.remove_if([](const Link& link) { return link.over(); });
    for (std::size_t i = 0; i < forwards_.size(); ++i) {
      if (polled[1 + i].revents != 0) accept(forwards_[i]);
    }
  }
  links_.clear();
}

void TcpProxy::accept(const Forward& forward) {
  transport::UniqueFd host = transport::tcp_accept(forward.listener.get());
  if (!host || links_.size() >= kMaxLinks) return;
  links_.emplace_back(std::move(host), forward.device, forward.port, writer_);
  if (links_.back().over()) links_.pop_back();
}

}  // namespace embody::capture
