#pragma once
// The one place where drivers read the time.
#include "core/base/time.hpp"

namespace embody::transport {

/// CLOCK_MONOTONIC, through the vDSO: no system call.
[[nodiscard]] inline TimePoint now() noexcept {
  return std::chrono::steady_clock::now();
}

}  // namespace embody::transport
