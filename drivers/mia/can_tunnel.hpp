#pragma once
// Whole messages of the Mia protocol over CAN, the same at both ends of the bus: by the kernel's ISO-TP, or in frames
// of our own (can_segments.hpp) where the kernel or the gateway has no ISO-TP.
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "core/base/result.hpp"
#include "core/hal/device.hpp"
#include "drivers/mia/can_segments.hpp"
#include "drivers/transport/can_frame.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::mia {

enum class CanFraming : std::uint8_t { kIsoTp, kSegments };

struct CanTunnelConfig {
  std::string interface { "can0" };  ///< or "unix:/path", the double of drivers/transport/can_double.hpp
  CanFraming framing{CanFraming::kIsoTp};
  transport::CanId tx{0x340};  ///< of what the host sends
  transport::CanId rx{0x341};  ///< of what the hand sends
  // ISO-TP only:
  bool padding{true};
  std::uint8_t padding_byte{0xCC};
  Duration st_min{0};  ///< least time between frames that we ask of the hand
  // Segments only:
  Duration message_timeout{std::chrono::milliseconds(20)};  ///< first to last frame of a message
};

class CanTunnel {
 public:
  CanTunnel() = default;
  CanTunnel(const CanTunnel&) = delete;
  CanTunnel& operator=(const CanTunnel&) = delete;
  virtual ~CanTunnel() = default;

  [[nodiscard]] virtual int fd() const noexcept = 0;
  /// kEmpty: no room. The message has not been sent, or not all of it: then the other end drops it.
  virtual IoStatus send(std::string_view message) noexcept = 0;
  /// The next message, 1..kMaxMessage bytes, valid until the next call. Neither waits nor allocates.
  virtual IoStatus receive(std::string_view& message) noexcept = 0;
  /// Messages lost on the way here, as far as that was seen.
  [[nodiscard]] virtual std::uint64_t lost() const noexcept = 0;
  /// Why the tunnel ended.
  [[nodiscard]] virtual std::string_view reason() const noexcept = 0;
};

/// Errors: kInvalidArgument, and those of open_can() and open_isotp().
[[nodiscard]] Result<std::unique_ptr<CanTunnel>> open_tunnel(const CanTunnelConfig& config);
/// A tunnel over a connection of the double that exists already; for simulators. @pre a framing and ids that
/// open_tunnel accepts
[[nodiscard]] std::unique_ptr<CanTunnel> adopt_tunnel(const CanTunnelConfig& config, transport::UniqueFd fd);
/// The same bus seen from the hand.
[[nodiscard]] CanTunnelConfig mirrored(CanTunnelConfig config);

}  // namespace embody::mia
