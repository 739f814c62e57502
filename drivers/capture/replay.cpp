#include "drivers/capture/replay.hpp"

#include <poll.h>

#include <algorithm>

#include "drivers/capture/replay_line.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::capture {
namespace {

constexpr timespec kReaderPoll{0, 20'000};      // nothing tells when somebody has read
constexpr timespec kTimePoll{0, 1'000'000};     // of recorded times
constexpr timespec kOpeningPoll{0, 1'000'000};  // nothing tells when a pseudo-terminal is opened
constexpr timespec kIdlePoll{0, 50'000'000};

}  // namespace

ReplayDevice::ReplayDevice(Capture capture, ReplayOptions options) : capture_(std::move(capture)), options_(options) {}

ReplayDevice::~ReplayDevice() {
  thread_.stop();
}

Status ReplayDevice::start() {
  const LinkKind link = capture_.header.link;
  if (link == LinkKind::kUdp || link == LinkKind::kCan) {
    return make_error(Errc::kUnsupported, link == LinkKind::kCan ? "a capture of CAN is played by CanReplay"
                                                                 : "a capture of UDP is not replayed");
  }
  if (capture_.chunks.empty()) return make_error(Errc::kInvalidArgument, "nothing to replay: the capture is empty");
  if (link == LinkKind::kSerial) {
    auto pty = transport::open_pty();
    if (!pty) return pty.error();
    pty_ = std::move(*pty);
    lines_.emplace_back(std::move(pty_.master), pty_.device, std::move(capture_.chunks), options_);
  } else if (const Status listening = listen(); !listening) {
    return listening;
  }
  thread_.start([this] { run(); });
  return {};
}

/// A port for each one of the device, with the chunks of its connections.
Status ReplayDevice::listen() {
  std::vector<std::vector<Chunk>*> scripts;  // by connection
  for (Chunk& chunk : capture_.chunks) {
    if (chunk.event == Event::kOpen) {
      auto port =
          std::find_if(ports_.begin(), ports_.end(), [&](const Port& p) { return p.device_port == chunk.port; });
      if (port == ports_.end()) {
        auto listener = transport::tcp_listen("127.0.0.1", 0);
        if (!listener) return listener.error();
        ports_.push_back({chunk.port, std::move(*listener), {}});
        port = std::prev(ports_.end());
      }
      scripts.push_back(&port->scripts.emplace_back());
    }
    if (chunk.connection > scripts.size() || chunk.connection == 0) {
      return make_error(Errc::kInvalidArgument, "connection %u of the capture was never opened", chunk.connection);
    }
    scripts[chunk.connection - 1]->push_back(std::move(chunk));
  }
  return {};
}

std::uint16_t ReplayDevice::port(std::uint16_t device_port) const noexcept {
  for (const Port& port : ports_) {
    if (device_port == 0 || port.device_port == device_port) return transport::local_port(port.listener.get());
  }
  return 0;
}

void ReplayDevice::run() {
  std::vector<pollfd> polled;
  while (true) {
    polled.assign(1, {thread_.stop_fd(), POLLIN, 0});
    for (const Port& port : ports_) polled.push_back({port.listener.get(), POLLIN, 0});
    const timespec timeout = serve(polled);
    if (::ppoll(polled.data(), polled.size(), &timeout, nullptr) < 0) continue;  // a signal
    if (polled[0].revents != 0) return;
    const std::scoped_lock lock(mutex_);
    std::size_t at = 1;
    for (Port& port : ports_) {
      if (polled[at++].revents != 0) accept(port);
    }
  }
}

/// Plays on; adds the lines to `polled` and returns how long to wait for them.
timespec ReplayDevice::serve(std::vector<pollfd>& polled) {
  const std::scoped_lock lock(mutex_);
  timespec timeout = kIdlePoll;
  const auto at_most = [&timeout](timespec other) { timeout.tv_nsec = std::min(timeout.tv_nsec, other.tv_nsec); };
  for (Line& line : lines_) {
    switch (line.serve(transport::now())) {
      case Line::Waits::kForReader:
        at_most(kReaderPoll);
        break;
      case Line::Waits::kForTime:
        at_most(kTimePoll);
        break;
      case Line::Waits::kForOpening:
        at_most(kOpeningPoll);
        continue;
      case Line::Waits::kForDriver:
      case Line::Waits::kOver:
        break;
    }
    if (line.readable()) polled.push_back({line.fd(), POLLIN, 0});
  }
  return timeout;
}

void ReplayDevice::accept(Port& port) {
  transport::UniqueFd fd = transport::tcp_accept(port.listener.get());
  if (!fd) return;
  if (port.scripts.empty()) {
    ++refused_;
    return;
  }
  lines_.emplace_back(std::move(fd), "", std::move(port.scripts.front()), options_);
  port.scripts.pop_front();
}

bool ReplayDevice::finished() {
  const std::scoped_lock lock(mutex_);
  const bool all_taken = std::all_of(ports_.begin(), ports_.end(), [](const Port& p) { return p.scripts.empty(); });
  return all_taken && std::all_of(lines_.begin(), lines_.end(),
                                  [](Line& line) { return line.serve(transport::now()) == Line::Waits::kOver; });
}

bool ReplayDevice::waits_for_driver() {
  const std::scoped_lock lock(mutex_);
  return std::all_of(lines_.begin(), lines_.end(), [](Line& line) {
    const auto waits = line.serve(transport::now());
    return waits != Line::Waits::kForReader && waits != Line::Waits::kForTime;
  });
}

ReplayReport ReplayDevice::report() {
  const std::scoped_lock lock(mutex_);
  ReplayReport report;
  report.refused = refused_;
  for (const Line& line : lines_) line.add_to(report);
  return report;
}

}  // namespace embody::capture
