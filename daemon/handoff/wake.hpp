#pragma once
// Wakes one waiting thread through a descriptor, so that it can wait for devices and for us in one poll with a
// deadline.
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cstdint>

#include "core/base/time.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody {

class Wake {
 public:
  Wake() : fd_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}
  [[nodiscard]] int fd() const noexcept { return fd_.get(); }
  /// Any thread. Never blocks.
  void notify() noexcept {
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = ::write(fd_.get(), &one, sizeof one);
  }
  /// The waiting thread, after waking.
  void clear() noexcept {
    std::uint64_t count = 0;
    [[maybe_unused]] const auto read = ::read(fd_.get(), &count, sizeof count);
  }

 private:
  transport::UniqueFd fd_;
};

/// Waits until one of up to two descriptors (negative ones are skipped) is readable or in error, or `timeout` is over.
/// Returns true when the first one is. One system call.
inline bool wait_for_input(int fd, int other_fd, Duration timeout) noexcept {
  pollfd entries[2] = {{fd, POLLIN, 0}, {other_fd, POLLIN, 0}};
  if (timeout < Duration{0}) timeout = Duration{0};
  const timespec limit{static_cast<time_t>(timeout.count() / 1'000'000'000),
                       static_cast<long>(timeout.count() % 1'000'000'000)};
  return ::ppoll(entries, 2, &limit, nullptr) > 0 && entries[0].revents != 0;
}

}  // namespace embody
