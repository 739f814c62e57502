#include "daemon/loops/watchdog_loop.hpp"

#include <sys/socket.h>

#include "drivers/transport/clock.hpp"

namespace embody {

void WatchdogLoop::run() noexcept {
  Watch arm;
  Watch tracker;
  Watch hand;
  TimePoint t_last = transport::now();
  while (!edges_.arm_finished.load(std::memory_order_relaxed)) {
    wait_for_input(-1, -1, kPeriod);
    edges_.heartbeats.watchdog.fetch_add(1, std::memory_order_relaxed);
    const TimePoint t = transport::now();
    // When this highest thread itself was late, the whole machine stood still: that says nothing about the loops.
    if (t - t_last > 2 * kPeriod) arm = tracker = hand = {};
    t_last = t;
    const bool arm_hung = hung(arm, edges_.heartbeats.arm, t);
    // At a stop the other loops end first; the arm loop is watched until it has braked.
    const bool stopping = edges_.stop.load(std::memory_order_relaxed);
    const bool others_hung = hung(tracker, edges_.heartbeats.tracker, t) | hung(hand, edges_.heartbeats.hand, t);
    if (arm_hung || (others_hung && !stopping)) edges_.watchdog_bit.store(true, std::memory_order_relaxed);
    if (const int fd = arm_.fd(); arm_hung && fd >= 0) ::shutdown(fd, SHUT_RDWR);
  }
}

bool WatchdogLoop::hung(Watch& watch, const std::atomic<std::uint64_t>& heartbeat, TimePoint now) noexcept {
  const std::uint64_t count = heartbeat.load(std::memory_order_relaxed);
  if (count != watch.count || watch.t_progress == TimePoint{}) {
    watch = {count, now};
    return false;
  }
  return now - watch.t_progress > kLongestSilence;
}

}  // namespace embody
