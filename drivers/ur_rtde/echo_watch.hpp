#pragma once
// Does the robot's program still read our commands? It repeats the newest sequence it has seen. Pure.
#include <cstdint>

#include "core/base/time.hpp"

namespace embody::ur {

class EchoWatch {
 public:
  explicit EchoWatch(Duration patience) noexcept : patience_(patience) {}

  void reset(std::uint32_t sequence) noexcept { sent_ = echo_ = sequence; }
  void sent(std::uint32_t sequence, TimePoint now) noexcept {
    if (echo_ == sent_) waiting_since_ = now;
    sent_ = sequence;
  }
  void seen(std::uint32_t echo, TimePoint now) noexcept {
    if (echo != echo_) waiting_since_ = now;
    echo_ = echo;
  }
  /// False when commands were sent and the echo has stood still for longer than the patience.
  [[nodiscard]] bool answers(TimePoint now) const noexcept {
    return echo_ == sent_ || now - waiting_since_ <= patience_;
  }

 private:
  Duration patience_;
  std::uint32_t sent_{0};
  std::uint32_t echo_{0};
  TimePoint waiting_since_{};
};

}  // namespace embody::ur
