#pragma once
// Messages of many bytes over CAN: the kernel's ISO-TP socket (ISO 15765-2; module can-isotp, Linux 5.10 and later).
// The double "unix:/path" carries whole messages, as the socket does for its user.
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/base/fixed_string.hpp"
#include "core/base/result.hpp"
#include "core/hal/device.hpp"
#include "drivers/transport/can_frame.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::transport {

struct IsoTpConfig {
  std::string interface { "can0" };
  CanId tx;                         ///< of what we send
  CanId rx;                         ///< of what we receive
  bool padding{true};               ///< frames are filled up to eight bytes
  std::uint8_t padding_byte{0xCC};  ///< with few equal bits in a row
  Duration st_min{0};               ///< least time between two frames that we ask of the sender
};

struct IsoTpCounters {
  std::uint64_t sent{0};
  std::uint64_t received{0};
  std::uint64_t busy{0};  ///< sends refused because the last message is still under way
  std::uint64_t lost{0};  ///< messages that the kernel gave up: no flow control, a frame lost, wrong padding
};

/// An open socket. send() and receive() neither wait nor allocate; after kDisconnected reason() says why.
class IsoTpSocket {
 public:
  IsoTpSocket(UniqueFd fd, std::string_view name) noexcept : fd_(std::move(fd)), name_(name) {}

  [[nodiscard]] int fd() const noexcept { return fd_.get(); }
  /// kEmpty: the last message is still under way, nothing was sent.
  IoStatus send(std::span<const char> message) noexcept;
  /// One whole message; one that does not fit `buffer` is dropped and counted as lost.
  Received receive(std::span<char> buffer) noexcept;

  [[nodiscard]] const IsoTpCounters& counters() const noexcept { return counters_; }
  [[nodiscard]] std::string_view reason() const noexcept { return reason_.view(); }

 private:
  bool gone(int code) noexcept;

  UniqueFd fd_;
  FixedString<40> name_;
  IsoTpCounters counters_;
  FixedString<240> reason_;
};

/// Errors: kInvalidArgument, kUnsupported (no CAN or no ISO-TP in the kernel), and those of find_can_interface().
[[nodiscard]] Result<IsoTpSocket> open_isotp(const IsoTpConfig& config);

/// STmin as a byte of the flow control frame: whole milliseconds up to 127, or 100..900 us; rounded up.
[[nodiscard]] std::uint8_t encode_st_min(Duration st_min) noexcept;

}  // namespace embody::transport
