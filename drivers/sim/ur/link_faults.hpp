#pragma once
// How the connections of the simulated controller misbehave on request, and the way out of a connection that obeys it.
#include <deque>
#include <random>
#include <vector>

#include "core/base/time.hpp"
#include "drivers/ur_rtde/wire.hpp"

namespace embody::sim {

struct LinkFaults {
  Duration jitter{0};        ///< each message waits up to this long; the order is kept
  bool single_bytes{false};  ///< one byte per segment
  unsigned coalesce{1};      ///< so many messages travel together, or what has waited for 20 ms

  [[nodiscard]] bool none() const noexcept { return jitter == Duration(0) && !single_bytes && coalesce <= 1; }
};

/// Messages on their way into one socket. Without faults nothing waits here.
class Outbox {
 public:
  /// False: the peer reads too slowly, or is gone.
  [[nodiscard]] bool send(int fd, rtde::Bytes message, const LinkFaults& faults, TimePoint now);
  /// Sends what is due.
  [[nodiscard]] bool pump(int fd, const LinkFaults& faults, TimePoint now);

 private:
  struct Waiting {
    TimePoint due;
    std::vector<std::byte> bytes;
  };
  [[nodiscard]] bool send_now(int fd, rtde::Bytes bytes, bool single_bytes) const noexcept;

  std::deque<Waiting> waiting_;
  std::minstd_rand random_{7};
};

}  // namespace embody::sim
