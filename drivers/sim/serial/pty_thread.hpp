#pragma once
// The thread of a simulated serial device: a pseudo-terminal on one side, the device's own model on the other.
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>

#include "drivers/sim/serial/device_link.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/pty.hpp"
#include "drivers/transport/tty.hpp"

namespace embody::sim {

/// `Device` has `Byte` (char or std::byte), `receive(span of Byte, now)`, `advance(now)` that returns the bytes it has
/// to say, `next_event()` (when it will next have some) and `forget_host()`. Every function may be called from any
/// thread; `mutex_` guards the device, `life_` orders start and stop.
template <class Device>
class PtyThread {
 public:
  /// `link`: path of a symlink to the pseudo-terminal; empty: none. The device is made from `arguments`.
  template <class... Arguments>
  explicit PtyThread(std::string link, Arguments&&... arguments)
      : link_path_(std::move(link)), device_(std::forward<Arguments>(arguments)...) {}
  ~PtyThread() { stop(); }
  PtyThread(const PtyThread&) = delete;
  PtyThread& operator=(const PtyThread&) = delete;

  /// Plugs the device in, again after stop(). Errors: kRefused (something other than a symlink is at `link`), kIo.
  Status start() {
    const std::scoped_lock lock(life_);
    unplug();
    auto pty = transport::open_pty();
    if (!pty) return pty.error();
    wake_.reset(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
    if (!wake_) return make_error(Errc::kIo, "cannot create an eventfd: %s", std::strerror(errno));
    if (!link_path_.empty()) {
      if (const Status linked = link_.create(link_path_, pty->device); !linked) return linked;
    }
    pty_ = std::move(*pty);
    leave_ = false;
    thread_ = std::thread([this] { run(); });
    return {};
  }

  /// Unplugs it: the host sees a hang-up; returns when that is so.
  void stop() noexcept {
    const std::scoped_lock lock(life_);
    unplug();
  }

  /// What a host opens; empty while it is unplugged.
  std::string path() {
    const std::scoped_lock lock(life_);
    return pty_.device;
  }

  /// The device has something else to do now: whoever waits looks again.
  void wake() noexcept {
    const std::scoped_lock lock(life_);
    if (wake_) signal();
  }

  /// Calls `function` with the device as it is now.
  template <class Function>
  auto with(Function function) {
    const std::scoped_lock lock(mutex_);
    return function(device_);
  }

 private:
  static constexpr Duration kHostCheck = std::chrono::milliseconds(5);  ///< while nobody has the device open

  static timespec to_timespec(Duration span) noexcept {
    span = std::max(span, Duration::zero());
    return {span.count() / 1'000'000'000, span.count() % 1'000'000'000};
  }

  void signal() noexcept {
    const std::uint64_t one = 1;
    static_cast<void>(!::write(wake_.get(), &one, sizeof one));
  }

  void unplug() noexcept {
    if (thread_.joinable()) {
      leave_ = true;
      signal();
      thread_.join();
    }
    link_.remove();
    pty_ = {};
    const std::scoped_lock lock(mutex_);
    device_.forget_host();
  }

  void run() {
    bool host_present = true;
    while (!leave_) {
      const short events = wait(host_present);
      if ((events & POLLIN) != 0) take_bytes();
      host_present = (events & POLLHUP) == 0 || (events & POLLIN) != 0;
      if (!host_present) forget_host();
      speak(host_present);
    }
  }

  void forget_host() {
    transport::make_raw(pty_.master.get());
    const std::scoped_lock lock(mutex_);
    device_.forget_host();
  }

  /// Waits for bytes, for the device's next event, or to be woken. A line without a host reports a hang-up at once and
  /// for ever: then it is only looked at every few milliseconds.
  short wait(bool host_present) {
    pollfd woken{wake_.get(), POLLIN, 0};
    std::optional<TimePoint> deadline;
    if (host_present) {
      deadline = with([](const Device& device) { return device.next_event(); });
    } else {
      const timespec pause = to_timespec(kHostCheck);
      ::ppoll(&woken, 1, &pause, nullptr);
      deadline = transport::now();
    }
    const timespec left = deadline ? to_timespec(*deadline - transport::now()) : timespec{};
    std::array<pollfd, 2> entries{pollfd{pty_.master.get(), POLLIN, 0}, woken};
    if (::ppoll(entries.data(), entries.size(), deadline ? &left : nullptr, nullptr) <= 0) return 0;
    std::uint64_t count = 0;
    if (entries[1].revents != 0 && !leave_) static_cast<void>(!::read(wake_.get(), &count, sizeof count));
    return entries[0].revents;
  }

  void take_bytes() {
    std::array<typename Device::Byte, 512> buffer;
    const auto [status, size] = transport::read_tty(pty_.master.get(), std::as_writable_bytes(std::span(buffer)));
    if (status != IoStatus::kDone) return;
    const std::scoped_lock lock(mutex_);
    device_.receive({buffer.data(), size}, transport::now());
  }

  /// A host that does not read loses what does not fit.
  void speak(bool host_present) {
    const auto text = with([](Device& device) { return device.advance(transport::now()); });
    if (text.empty() || !host_present) return;
    static_cast<void>(transport::write_tty(pty_.master.get(), std::as_bytes(std::span(text))));
  }

  std::mutex life_;
  std::string link_path_;
  DeviceLink link_;
  transport::Pty pty_;
  transport::UniqueFd wake_;
  std::atomic<bool> leave_{false};
  std::thread thread_;
  std::mutex mutex_;
  Device device_;
};

}  // namespace embody::sim
