#pragma once
// Supervises the other loops from above: a loop that does not return from its waits is hung.
#include "daemon/loops/edges.hpp"

namespace embody {

class WatchdogLoop {
 public:
  WatchdogLoop(const ArmBaton& arm, Edges& edges) noexcept : arm_(arm), edges_(edges) {}
  /// Until the arm loop has ended. On a hung arm, tracker or hand loop: latches edges.watchdog_bit (mode *stopped*, and
  /// main stops feeding systemd's watchdog), and for the arm loop shuts the robot's socket, so that the robot brakes by
  /// itself.
  void run() noexcept;

 private:
  static constexpr Duration kPeriod = std::chrono::milliseconds(50);
  static constexpr Duration kLongestSilence = std::chrono::milliseconds(400);  // waits end after 20 ms at most

  struct Watch {
    std::uint64_t count{0};
    TimePoint t_progress{};
  };
  [[nodiscard]] static bool hung(Watch& watch, const std::atomic<std::uint64_t>& heartbeat, TimePoint now) noexcept;

  const ArmBaton& arm_;
  Edges& edges_;
};

}  // namespace embody
