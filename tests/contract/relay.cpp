#include "tests/contract/relay.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <mutex>
#include <utility>
#include <vector>

#include "drivers/transport/pty.hpp"
#include "tests/contract/laws.hpp"

namespace embody::test {
namespace {

constexpr int kIdle_ms = 2;  ///< between two looks at a line that nobody has plugged in

/// Sockets must not raise SIGPIPE here, and must be free to raise it in the driver.
bool put(int fd, std::span<const std::byte> bytes) {
  const ssize_t sent = ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  if (sent >= 0) return true;
  if (errno == ENOTSOCK) return ::write(fd, bytes.data(), bytes.size()) >= 0 || errno == EAGAIN || errno == EIO;
  return errno == EAGAIN;
}

}  // namespace

Relay::Relay(std::unique_ptr<Socket> socket, Open open, Tap tap)
    : socket_(std::move(socket)),
      open_(std::move(open)),
      tap_(std::move(tap)),
      buffer_(65536),
      wake_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  const Status appeared = socket_->appear();
  EXPECT_TRUE(appeared.ok()) << appeared.error().detail.view();
  ::eventfd_write(wake_.get(), 1);  // somebody may have plugged in already
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Relay::~Relay() {
  thread_.request_stop();
  ::eventfd_write(wake_.get(), 1);
}

void Relay::cut() {
  now([this] {
    socket_->vanish();
    pairs_.clear();
  });
}

void Relay::restore() {
  now([this] {
    hushed_ = false;
    const Status appeared = socket_->appear();
    EXPECT_TRUE(appeared.ok()) << appeared.error().detail.view();
  });
}

void Relay::hush() {
  now([this] { hushed_ = true; });
}

void Relay::inject(std::span<const std::byte> bytes) {
  now([this, bytes] {
    for (const Pair& pair : pairs_) put(pair.driver.get(), bytes);
  });
}

/// Runs `work` on the relay's thread and waits for it.
void Relay::now(std::function<void()> work) {
  std::packaged_task<void()> task(std::move(work));
  auto done = task.get_future();
  {
    const std::scoped_lock lock(mutex_);
    work_.push_back(std::move(task));
  }
  ::eventfd_write(wake_.get(), 1);
  done.get();
}

void Relay::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    wait();
    std::list<std::packaged_task<void()>> work;
    {
      const std::scoped_lock lock(mutex_);
      work.swap(work_);
    }
    for (auto& task : work) task();
    accept();
    pairs_.remove_if([this](Pair& pair) { return !carry(pair); });
  }
}

void Relay::wait() {
  std::vector<pollfd> entries{{wake_.get(), POLLIN, 0}, {socket_->fd(), POLLIN, 0}};
  for (const Pair& pair : pairs_) {
    entries.push_back({pair.driver_done ? -1 : pair.driver.get(), POLLIN, 0});
    entries.push_back({pair.device.get(), POLLIN, 0});
  }
  ::poll(entries.data(), entries.size(), -1);
  eventfd_t count = 0;
  ::eventfd_read(wake_.get(), &count);
  for (const pollfd& entry : entries) {
    if ((entry.revents & POLLIN) != 0) return;
  }
  ::poll(entries.data(), 1, kIdle_ms);  // a serial line without a host says POLLHUP for ever
}

void Relay::accept() {
  while (transport::UniqueFd driver = socket_->accept()) {
    auto device = open_();
    if (device) pairs_.push_back({++connections_, std::move(driver), std::move(*device), false});
  }
}

/// False when the pair is over. A driver that says goodbye and hangs up is heard out by the device.
bool Relay::carry(Pair& pair) {
  if (!pair.driver_done && !hear_driver(pair)) {
    pair.driver_done = true;
    if (::shutdown(pair.device.get(), SHUT_WR) != 0) return false;
  }
  return hear_device(pair);
}

bool Relay::hear_driver(Pair& pair) {
  const ssize_t size = ::read(pair.driver.get(), buffer_.data(), buffer_.size());
  if (size < 0 && errno == EIO) return transport::make_raw(pair.driver.get());  // a serial line that nobody has open
  if (size < 0) return errno == EAGAIN || errno == EINTR;
  if (size == 0) return false;
  const auto bytes = std::span(buffer_).first(static_cast<std::size_t>(size));
  if (tap_) tap_(pair.number, bytes);
  return put(pair.device.get(), bytes);
}

bool Relay::hear_device(Pair& pair) {
  const ssize_t size = ::read(pair.device.get(), buffer_.data(), buffer_.size());
  if (size < 0) return errno == EAGAIN || errno == EINTR;
  if (size == 0) return false;
  return hushed_ || put(pair.driver.get(), std::span(buffer_).first(static_cast<std::size_t>(size)));
}

}  // namespace embody::test
