#pragma once
// What a CAN controller reports about its bus: SocketCAN's error frames (linux/can/error.h), decoded. Pure functions.
#include <array>
#include <cstdint>

namespace embody::transport {

struct CanErrors {
  bool bus_off{false};           ///< the controller has left the bus
  bool restarted{false};         ///< it is back after bus-off
  bool error_passive{false};     ///< an error counter beyond 127
  bool error_warning{false};     ///< an error counter beyond 95
  bool error_active{false};      ///< the counters are low again
  bool no_ack{false};            ///< no other node acknowledged a frame: is anybody on the bus?
  bool arbitration_lost{false};  ///< usual on a shared bus
  bool protocol{false};          ///< bit, form, stuff or bus error: wiring, termination, bit rate
  bool overflow{false};          ///< the controller lost frames
  bool tx_timeout{false};        ///< the driver gave a frame up

  friend constexpr bool operator==(const CanErrors&, const CanErrors&) = default;
};

/// The two parts of an error frame: error classes (the identifier without its flags) and eight data bytes.
struct CanErrorFrame {
  std::uint32_t classes{0};
  std::array<std::uint8_t, 8> data{};
};

[[nodiscard]] CanErrors decode_can_errors(const CanErrorFrame& frame) noexcept;
/// The other way, for simulators.
[[nodiscard]] CanErrorFrame encode_can_errors(const CanErrors& errors) noexcept;

}  // namespace embody::transport
