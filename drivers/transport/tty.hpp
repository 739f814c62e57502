#pragma once
// Serial lines and pseudo-terminals: raw, non-blocking, one owner.
#include <cstddef>
#include <span>
#include <string>

#include "core/base/result.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::transport {

struct Tty {
  UniqueFd fd;
  bool low_latency{false};  ///< the driver accepted the low-latency flag
};

/// Opens `device` raw, 115200 baud, 8N1, no flow control, non-blocking and close-on-exec; drops what its buffers hold.
/// The line belongs to one process at a time: an advisory lock (released by the kernel even after a crash) and, for
/// programs that do not look at locks, TIOCEXCL. `low_latency` asks a USB adapter to pass bytes on at once instead of
/// every 16 ms; devices without that flag are opened all the same.
/// Errors: kNotFound, kPermission, kRefused (busy), kInvalidArgument (not a serial line), kIo.
[[nodiscard]] Result<Tty> open_tty(const std::string& device, bool low_latency = true);

/// One read() without waiting. End of file and errors other than EAGAIN are kDisconnected.
[[nodiscard]] Received read_tty(int fd, std::span<std::byte> buffer) noexcept;

/// One write() without waiting. kEmpty: the buffer is full, nothing was sent. A partly written message counts as sent:
/// serial peers resynchronise on the next frame. Other errors are kDisconnected.
[[nodiscard]] IoStatus write_tty(int fd, std::span<const std::byte> message) noexcept;

}  // namespace embody::transport
