#pragma once
// One command per bus period of the robot hand (Mia: 20 Hz).
#include "core/safety/hand_gate.hpp"
#include "daemon/loops/edges.hpp"

namespace embody {

struct HandLoopConfig {
  Duration period{std::chrono::milliseconds(50)};
};

class HandLoop {
 public:
  HandLoop(HandBaton& baton, const safety::HandGateConfig& gate, const HandLoopConfig& config, Edges& edges) noexcept
      : baton_(baton), gate_(gate), config_(config), edges_(edges) {}
  /// Until edges.stop; then stops the motors. No heap, lock, log or exception.
  void run() noexcept;

 private:
  void read() noexcept;
  void cycle(TimePoint now) noexcept;
  void stop_motors() noexcept;
  void lose_hand() noexcept;

  HandBaton& baton_;
  safety::HandGate gate_;
  HandLoopConfig config_;
  Edges& edges_;
  HandReport report_;
  TimePoint t_next_{};
  std::uint32_t sequence_{0};
};

}  // namespace embody
