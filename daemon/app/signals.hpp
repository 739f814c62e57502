#pragma once
// Signals as events of a loop: blocked everywhere, read through a descriptor.
#include <sys/signalfd.h>
#include <unistd.h>

#include <csignal>

#include "drivers/transport/unique_fd.hpp"

namespace embody {

/// SIGINT and SIGTERM as a readable descriptor. Create it before any thread. SIGPIPE is ignored.
class StopSignals {
 public:
  StopSignals() {
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &set, nullptr);
    std::signal(SIGPIPE, SIG_IGN);
    fd_.reset(::signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC));
  }
  [[nodiscard]] int fd() const noexcept { return fd_.get(); }
  /// Number of the next pending signal, 0 when there is none.
  [[nodiscard]] int take() noexcept {
    signalfd_siginfo info{};
    return ::read(fd_.get(), &info, sizeof info) == sizeof info ? static_cast<int>(info.ssi_signo) : 0;
  }
  /// From now on a further signal ends the process at once: the operator is impatient. Signals that are pending now
  /// belong to the stop that is under way.
  void restore() noexcept {
    while (take() != 0) {
    }
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGTERM);
    pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
  }

 private:
  transport::UniqueFd fd_;
};

}  // namespace embody
