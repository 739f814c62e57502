#include "drivers/capture/tcp_link.hpp"

#include <netinet/tcp.h>
#include <sys/socket.h>

#include <cerrno>

namespace embody::capture {
namespace {

transport::UniqueFd begin_connect(const sockaddr_in& device) {
  transport::UniqueFd fd(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int on = 1;
  ::setsockopt(fd.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  const int result = ::connect(fd.get(), reinterpret_cast<const sockaddr*>(&device), sizeof device);
  if (result != 0 && errno != EINPROGRESS) fd.reset();
  return fd;
}

int pending_error(int fd) {
  int error = 0;
  socklen_t size = sizeof error;
  return ::getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : errno;
}

/// Closes with RST instead of FIN.
void abort_connection(transport::UniqueFd& fd) {
  const linger now{1, 0};
  ::setsockopt(fd.get(), SOL_SOCKET, SO_LINGER, &now, sizeof now);
  fd.reset();
}

}  // namespace

TcpProxy::Link::Link(transport::UniqueFd host, const sockaddr_in& device, std::uint16_t port, CaptureWriter& writer)
    : writer_(writer), host_(std::move(host)), device_(begin_connect(device)), number_(writer.connection(port)) {
  if (!device_) reset(End::kDevice);
}

std::array<pollfd, 2> TcpProxy::Link::interest() const {
  if (connecting_) return {pollfd{-1, 0, 0}, pollfd{device_.get(), POLLOUT, 0}};
  const auto events = [](const Pipe& from, const Pipe& to) {
    return static_cast<short>((from.reads() ? POLLIN : 0) | (to.waits_for_receiver() ? POLLOUT : 0));
  };
  return {pollfd{host_.get(), events(out_, in_), 0}, pollfd{device_.get(), events(in_, out_), 0}};
}

void TcpProxy::Link::serve(const pollfd& host, const pollfd& device) {
  if (connecting_) finish_connecting(device.revents);
  if (connecting_ || over()) return;
  if ((host.revents | device.revents) == 0) return;
  move(out_, End::kHost);
  move(in_, End::kDevice);
  check_errors(host, End::kHost);
  check_errors(device, End::kDevice);
  if (!ended_[0] || !ended_[1]) return;
  host_.reset();
  device_.reset();
}

void TcpProxy::Link::finish_connecting(short revents) {
  if (revents == 0) return;
  connecting_ = false;
  if (pending_error(device_.get()) != 0) reset(End::kDevice);
}

void TcpProxy::Link::move(Pipe& pipe, End sender) {
  const End receiver = sender == End::kHost ? End::kDevice : End::kHost;
  if (over() || ended_[static_cast<std::size_t>(sender)]) return;
  const Event direction = sender == End::kHost ? Event::kOut : Event::kIn;
  switch (pipe.move(fd(sender), fd(receiver), [&](auto chunk) { writer_.bytes(number_, direction, chunk); })) {
    case Pipe::State::kOpen:
      break;
    case Pipe::State::kEnded:
      ended_[static_cast<std::size_t>(sender)] = true;
      writer_.closed(number_, sender, false);
      ::shutdown(fd(receiver), SHUT_WR);
      break;
    case Pipe::State::kSenderBroken:
      reset(sender);
      break;
    case Pipe::State::kReceiverBroken:
      reset(receiver);
      break;
  }
}

/// A reset that no read or write tells of: the end has half-closed before, or its bytes wait.
void TcpProxy::Link::check_errors(const pollfd& entry, End end) {
  if (!over() && (entry.revents & POLLERR) != 0) {
    if (pending_error(fd(end)) != 0 || ended_[static_cast<std::size_t>(end)]) reset(end);
  }
}

void TcpProxy::Link::reset(End by) {
  writer_.closed(number_, by, true);
  abort_connection(host_);
  abort_connection(device_);
}

}  // namespace embody::capture
