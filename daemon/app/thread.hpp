#pragma once
// A named thread with an explicit small stack and its own scheduling.
#include <pthread.h>

#include <functional>
#include <string>
#include <vector>

#include "core/base/result.hpp"

namespace embody {

struct ThreadOptions {
  std::string name;        ///< at most 15 characters
  int fifo_priority{0};    ///< SCHED_FIFO at this priority; 0: SCHED_OTHER
  std::vector<int> cpus;   ///< empty: all
  bool watch_heap{false};  ///< count this thread's heap use (heap_guard.hpp)
};

/// Runs `body` from start() until it returns; the destructor joins. Scheduling never comes from the creator.
class Thread {
 public:
  Thread() = default;
  Thread(const Thread&) = delete;
  Thread& operator=(const Thread&) = delete;
  ~Thread() { join(); }

  /// Errors: kPermission (real-time priority refused), kIo. After an error nothing runs.
  [[nodiscard]] Status start(const ThreadOptions& options, std::function<void()> body);
  void join() noexcept;

 private:
  static void* enter(void* self);

  ThreadOptions options_;
  std::function<void()> body_;
  pthread_t thread_{};
  bool running_{false};
};

/// Whether this process may use SCHED_FIFO at `priority` (tried on a short-lived thread).
[[nodiscard]] bool may_use_fifo(int priority) noexcept;

/// Keeps all memory resident. Errors: kPermission with what to change.
[[nodiscard]] Status lock_memory() noexcept;

}  // namespace embody
