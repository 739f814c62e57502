#include "drivers/capture/pty_proxy.hpp"

#include <poll.h>
#include <termios.h>

#include <array>

#include "drivers/transport/tty.hpp"

namespace embody::capture {
namespace {

constexpr int kReopenPoll_ms = 2;  // nothing wakes a poller when somebody opens a pseudo-terminal

bool is_open(int master) {
  pollfd entry{master, 0, 0};
  return ::poll(&entry, 1, 0) >= 0 && (entry.revents & POLLHUP) == 0;
}

}  // namespace

Status PtyProxy::open(const std::string& device) {
  auto line = transport::open_tty(device);
  if (!line) return line.error();
  auto pty = transport::open_pty();
  if (!pty) return pty.error();
  line_ = std::move(line->fd);
  pty_ = std::move(*pty);
  device_ = pty_.device;
  thread_.start([this] { run(); });
  return {};
}

void PtyProxy::run() {
  while (!over_) {
    if (!connection_ && is_open(pty_.master.get())) begin();
    const bool open = connection_.has_value();
    const auto events = [](const Pipe& from, const Pipe& to) {
      return static_cast<short>((from.reads() ? POLLIN : 0) | (to.waits_for_receiver() ? POLLOUT : 0));
    };
    pollfd polled[3] = {{thread_.stop_fd(), POLLIN, 0},
                        {line_.get(), open ? events(*in_, *out_) : static_cast<short>(POLLIN), 0},
                        {open ? pty_.master.get() : -1, open ? events(*out_, *in_) : static_cast<short>(0), 0}};
    if (::poll(polled, 3, open ? -1 : kReopenPoll_ms) < 0) continue;  // a signal
    if (polled[0].revents != 0) break;
    if (open && (polled[1].revents | polled[2].revents) != 0) serve();
    if (!open && polled[1].revents != 0) discard();
  }
  line_.reset();
  pty_.master.reset();
}

void PtyProxy::serve() {
  const auto out = out_->move(pty_.master.get(), line_.get(),
                              [this](auto chunk) { writer_.bytes(*connection_, Event::kOut, chunk); });
  const auto in =
      in_->move(line_.get(), pty_.master.get(), [this](auto chunk) { writer_.bytes(*connection_, Event::kIn, chunk); });
  if (out == Pipe::State::kReceiverBroken || in == Pipe::State::kSenderBroken) {
    hang_up();
  } else if (out == Pipe::State::kSenderBroken || in == Pipe::State::kReceiverBroken) {
    end_of_driver();
  }
}

/// What the device says while nobody listens.
void PtyProxy::discard() {
  std::array<std::byte, 4096> buffer;
  if (transport::read_tty(line_.get(), buffer).status == IoStatus::kDisconnected) hang_up();
}

void PtyProxy::begin() {
  ::tcflush(line_.get(), TCIFLUSH);  // as opening the real line would
  out_.emplace(&read_terminal, &write_terminal);
  in_.emplace(&read_terminal, &write_terminal);
  connection_ = writer_.connection(0);
}

void PtyProxy::end_of_driver() {
  writer_.closed(*connection_, End::kHost, false);
  connection_.reset();
  ::tcflush(pty_.master.get(), TCIOFLUSH);
  transport::make_raw(pty_.master.get());
}

void PtyProxy::hang_up() {
  if (connection_) writer_.closed(*connection_, End::kDevice, true);
  connection_.reset();
  over_ = true;
}

}  // namespace embody::capture
