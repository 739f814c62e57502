#pragma once
// What passes over frames share: CPU time, and samples of several recordings in one list.
#include <ctime>
#include <vector>

#include "core/base/time.hpp"

namespace embody::evaluate {

/// CPU time of the calling thread. About 0.3 us.
[[nodiscard]] inline Duration thread_time() noexcept {
  timespec t{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return std::chrono::seconds(t.tv_sec) + std::chrono::nanoseconds(t.tv_nsec);
}

template <class T>
void append(std::vector<T>& to, const std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

}  // namespace embody::evaluate
