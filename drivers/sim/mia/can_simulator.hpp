#pragma once
// A Mia hand behind a CAN gateway that exists only in this process: the profiles of drivers/mia/can_line.hpp and
// drivers/mia/compact, on the double "unix:/path" or on a kernel interface (vcan0). The profiles are our own.
#include <array>
#include <memory>
#include <string>
#include <string_view>

#include "core/base/result.hpp"
#include "drivers/mia/can_tunnel.hpp"
#include "drivers/sim/mia/can_compact_hand.hpp"
#include "drivers/sim/mia/mia_simulator.hpp"

namespace embody::sim {

enum class CanProfile : std::uint8_t { kTunnel, kCompact };

struct CanSimulatorConfig {
  std::string interface { "unix:/tmp/mia-can" };  ///< where the hand is
  CanProfile profile{CanProfile::kCompact};
  mia::CanTunnelConfig tunnel;     ///< profile kTunnel: as the host has it, but for the interface
  MiaSimulatorConfig serial_hand;  ///< profile kTunnel: the hand behind the gateway
  CompactHandConfig compact_hand;  ///< profile kCompact
};

struct CanSimulatorCounters {
  std::uint64_t commands{0};
  std::uint64_t motions{0};
  std::uint64_t stops{0};
  std::uint64_t hosts{0};  ///< connections of the double
};

/// One thread between start() and stop(). One host at a time: a new one replaces the last. The hand obeys and moves on
/// while its bus is down. Every function may be called from any thread, but start() and stop() only from one.
class MiaCanSimulator {
 public:
  explicit MiaCanSimulator(const CanSimulatorConfig& config);
  ~MiaCanSimulator();  ///< stop()
  MiaCanSimulator(const MiaCanSimulator&) = delete;
  MiaCanSimulator& operator=(const MiaCanSimulator&) = delete;

  /// Errors: those of double_listen(), open_can() and open_isotp().
  Status start();
  void stop() noexcept;

  [[nodiscard]] CanSimulatorCounters counters() const;
  [[nodiscard]] CompactHandCounters compact_counters() const;
  [[nodiscard]] std::array<double, mia::kMotors> motor_counts() const;  ///< now

  /// One fault by name.
  ///   both     "down" and "up" (the double's interface), "bus_off", "error_passive", "no_ack" (error frames)
  ///   compact  "silent on|off", "silent MOTOR on|off", "drop_ack n", "wrong_crc n" (acknowledgements), "garble n",
  ///            "drop_state n", "counter_stuck on|off", "undervoltage on|off", "restart", "calibrate"
  ///   tunnel   those of MiaDevice::fault()
  /// MOTOR is thumb, index or mrl. Errors: kInvalidArgument; kRefused ("bus_off" and the like without a host).
  Status fault(std::string_view text);

 private:
  class Gateway;
  std::unique_ptr<Gateway> gateway_;
};

}  // namespace embody::sim
