#include "daemon/control/control_server.hpp"

#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/timerfd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <exception>
#include <utility>
#include <vector>

namespace embody::control {
namespace {

using transport::UniqueFd;

constexpr std::size_t kMaxClients = 16;
constexpr std::size_t kMaxUnreadBytes = std::size_t{256} * 1024;
constexpr std::size_t kReadBytes = std::size_t{16} * 1024;  // per client and call

struct Client {
  UniqueFd fd;
  Peer peer;
  UniqueFd timer;  // of a subscription
  std::optional<std::int64_t> subscription_id;
  std::string in;
  std::string out;
  bool waits_for_room{false};  // registered for EPOLLOUT
  bool closing{false};         // nothing more is read; ends when `out` is sent
  bool dead{false};
};

Peer peer_of(int fd) noexcept {
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (::getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) return {};
  return {credentials.pid, credentials.uid};
}

}  // namespace

class ControlServer::Impl {
 public:
  Impl(Listener listener, UniqueFd epoll, Handler handler, LineHandler lines)
      : listener_(std::move(listener)),
        epoll_(std::move(epoll)),
        handler_(std::move(handler)),
        lines_(std::move(lines)) {
    clients_.reserve(kMaxClients);
  }

  ~Impl() {
    for (Client& client : clients_) flush(client);
  }

  void serve() {
    std::array<epoll_event, 64> events;
    const int count = ::epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), 0);
    for (int i = 0; i < count; ++i) handle(events[static_cast<std::size_t>(i)]);
    remove_dead();
  }

  [[nodiscard]] bool watch(int fd, std::uint32_t what) noexcept {
    epoll_event event{};
    event.events = what;
    event.data.fd = fd;
    return ::epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, fd, &event) == 0;
  }

  [[nodiscard]] int fd() const noexcept { return epoll_.get(); }
  [[nodiscard]] int listener_fd() const noexcept { return listener_.fd.get(); }
  [[nodiscard]] const ServerCounters& counters() const noexcept { return counters_; }
  [[nodiscard]] std::size_t client_count() const noexcept { return clients_.size(); }

 private:
  void remove_dead() {
    std::erase_if(clients_, [](const Client& client) { return client.dead; });
  }

  void handle(const epoll_event& event) {
    const int fd = event.data.fd;
    if (fd == listener_fd()) return accept_all();
    for (Client& client : clients_) {
      if (client.dead) continue;
      if (client.timer.get() == fd) return push_status(client);
      if (client.fd.get() != fd) continue;
      if ((event.events & EPOLLOUT) != 0) flush(client);
      if ((event.events & (EPOLLIN | EPOLLHUP | EPOLLERR)) != 0 && !client.dead) read(client);
      return;
    }
  }

  void accept_all() {
    remove_dead();  // their places are free
    for (std::size_t i = 0; i < kMaxClients; ++i) {
      UniqueFd fd(::accept4(listener_fd(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
      if (!fd) return;
      ++counters_.connections;
      if (clients_.size() >= kMaxClients || !watch(fd.get(), EPOLLIN)) {
        ++counters_.dropped;
        const std::string line = format_response(refusal(code::kBusy, "the daemon has too many clients"), {});
        (void)::send(fd.get(), line.data(), line.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
        continue;
      }
      Client client;
      client.peer = peer_of(fd.get());
      client.fd = std::move(fd);
      clients_.push_back(std::move(client));
    }
  }

  void read(Client& client) {
    std::array<char, kReadBytes> buffer;
    const ssize_t size = ::recv(client.fd.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (size <= 0) {
      client.dead = true;
      return;
    }
    if (client.closing) return;  // discarded
    client.in.append(buffer.data(), static_cast<std::size_t>(size));
    take_lines(client);
    flush(client);
  }

  void take_lines(Client& client) {
    std::size_t start = 0;
    for (std::size_t end = 0; !client.closing && (end = client.in.find('\n', start)) != std::string::npos;
         start = end + 1) {
      if (end - start > kMaxLineBytes) return refuse_overlong(client);
      answer(client, std::string_view(client.in).substr(start, end - start));
    }
    client.in.erase(0, start);
    if (client.in.size() > kMaxLineBytes) refuse_overlong(client);
  }

  void refuse_overlong(Client& client) {
    ++counters_.malformed;
    ++counters_.dropped;
    client.out += format_response(refusal(code::kMalformed, "a request has at most 65536 bytes"), {});
    client.in.clear();
    client.closing = true;
  }

  void answer(Client& client, std::string_view line) {
    if (line.empty() || line == "\r") return;
    if (lines_) {
      ++counters_.requests;
      client.out += answer_line(line);
      return;
    }
    auto request = parse_request(line);
    if (!request) {
      ++counters_.malformed;
      const bool version = request.error().code == Errc::kUnsupported;
      const char* error_code = version ? code::kProtocolVersion : code::kMalformed;
      client.out += format_response(refusal(error_code, std::string(request.error().detail.view())), {});
      return;
    }
    ++counters_.requests;
    request->peer = client.peer;
    if (request->command == Command::kSubscribe) return subscribe(client, *request);
    client.out += format_response(ask(*request), request->id);
  }

  [[nodiscard]] std::string answer_line(std::string_view line) const {
    try {
      return lines_(line);
    } catch (const std::exception& error) {
      return format_response(refusal(code::kFailed, error.what()), {});
    }
  }

  [[nodiscard]] Response ask(const Request& request) const {
    try {
      return handler_(request);
    } catch (const std::exception& error) {
      return refusal(code::kFailed, error.what());
    }
  }

  void subscribe(Client& client, const Request& request) {
    if (!client.timer) {
      client.timer.reset(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC));
      if (!client.timer || !watch(client.timer.get(), EPOLLIN)) {
        client.timer.reset();
        client.out += format_response(refusal(code::kFailed, "the daemon has no timer left"), request.id);
        return;
      }
    }
    itimerspec period{};
    const auto whole = std::chrono::duration_cast<std::chrono::seconds>(request.interval);
    period.it_interval.tv_sec = whole.count();
    period.it_interval.tv_nsec = std::chrono::nanoseconds(request.interval - whole).count();
    period.it_value = period.it_interval;
    ::timerfd_settime(client.timer.get(), 0, &period, nullptr);
    client.subscription_id = request.id;
    append_status(client);
  }

  void push_status(Client& client) {
    std::uint64_t expirations = 0;
    if (::read(client.timer.get(), &expirations, sizeof expirations) != sizeof expirations) return;
    append_status(client);
    flush(client);
  }

  void append_status(Client& client) {
    Request request;
    request.peer = client.peer;
    client.out += format_response(ask(request), client.subscription_id);
  }

  /// Sends what fits. A client that does not read is dropped when too much waits for it.
  void flush(Client& client) {
    while (!client.out.empty()) {
      const ssize_t sent = ::send(client.fd.get(), client.out.data(), client.out.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent < 0 && errno == EAGAIN) break;
      if (sent <= 0) {
        client.dead = true;
        return;
      }
      client.out.erase(0, static_cast<std::size_t>(sent));
    }
    if (client.out.size() > kMaxUnreadBytes) {
      ++counters_.dropped;
      client.dead = true;
      return;
    }
    if (client.closing && client.out.empty()) client.dead = true;
    wait_for_room(client, !client.out.empty());
  }

  void wait_for_room(Client& client, bool wanted) noexcept {
    if (client.waits_for_room == wanted) return;
    client.waits_for_room = wanted;
    epoll_event event{};
    event.events = EPOLLIN | (wanted ? static_cast<std::uint32_t>(EPOLLOUT) : 0U);
    event.data.fd = client.fd.get();
    ::epoll_ctl(epoll_.get(), EPOLL_CTL_MOD, client.fd.get(), &event);
  }

  Listener listener_;
  UniqueFd epoll_;
  Handler handler_;
  LineHandler lines_;  // in place of the handler
  std::vector<Client> clients_;
  ServerCounters counters_;
};

Result<std::unique_ptr<ControlServer>> ControlServer::open(const ServerConfig& config, Handler handler,
                                                           LineHandler lines) {
  auto listener = listen_unix(config.path, config.group_access, config.owner);
  if (!listener) return listener.error();
  UniqueFd epoll(::epoll_create1(EPOLL_CLOEXEC));
  auto impl = std::make_unique<Impl>(std::move(*listener), std::move(epoll), std::move(handler), std::move(lines));
  if (impl->fd() < 0 || !impl->watch(impl->listener_fd(), EPOLLIN)) {
    return make_error(Errc::kIo, "control socket: the system has no epoll descriptor left");
  }
  return std::unique_ptr<ControlServer>(new ControlServer(std::move(impl)));
}

Result<std::unique_ptr<ControlServer>> ControlServer::open(const ServerConfig& config, Handler handler) {
  return open(config, std::move(handler), nullptr);
}

Result<std::unique_ptr<ControlServer>> ControlServer::open_lines(const ServerConfig& config, LineHandler handler) {
  return open(config, nullptr, std::move(handler));
}

ControlServer::ControlServer(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
ControlServer::~ControlServer() = default;

int ControlServer::fd() const noexcept {
  return impl_->fd();
}
void ControlServer::serve() {
  impl_->serve();
}
const ServerCounters& ControlServer::counters() const noexcept {
  return impl_->counters();
}
std::size_t ControlServer::client_count() const noexcept {
  return impl_->client_count();
}

}  // namespace embody::control
