#pragma once
// Ends a thread that waits in poll().
#include <sys/eventfd.h>

#include <thread>

#include "drivers/transport/unique_fd.hpp"

namespace embody::capture {

/// A thread whose function polls stop_fd() and returns once that is readable. The destructor waits for it: make it the
/// last member.
class PollThread {
 public:
  PollThread() = default;
  PollThread(const PollThread&) = delete;
  PollThread& operator=(const PollThread&) = delete;
  ~PollThread() { stop(); }

  template <class Run>
  void start(Run run) {
    thread_ = std::thread(std::move(run));
  }
  void stop() {
    if (!thread_.joinable()) return;
    ::eventfd_write(stop_.get(), 1);
    thread_.join();
  }
  [[nodiscard]] int stop_fd() const noexcept { return stop_.get(); }

 private:
  transport::UniqueFd stop_{::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)};
  std::thread thread_;
};

}  // namespace embody::capture
