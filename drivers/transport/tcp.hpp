#pragma once
// TCP over non-blocking descriptors. Functions that wait take a deadline and wait in poll(); none of them throws.
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "core/hal/hand_tracker.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::transport {

/// Opens a connection (numeric address or name), non-blocking, TCP_NODELAY, close-on-exec.
/// Errors: kNotFound (name), kDisconnected (nobody listens), kTimeout.
[[nodiscard]] Result<UniqueFd> tcp_connect(const std::string& host, std::uint16_t port, TimePoint deadline);

/// Listens on `address` (numeric IPv4); port 0 takes a free one. Non-blocking, SO_REUSEADDR.
[[nodiscard]] Result<UniqueFd> tcp_listen(const std::string& address, std::uint16_t port);

/// Port of a bound descriptor, 0 on failure.
[[nodiscard]] std::uint16_t local_port(int fd) noexcept;

/// Takes one waiting connection (non-blocking, TCP_NODELAY), or an empty descriptor when nobody waits.
[[nodiscard]] UniqueFd tcp_accept(int listener) noexcept;

/// What one non-blocking receive brought.
struct Received {
  IoStatus status{IoStatus::kEmpty};  ///< kDone with size > 0, kEmpty, or kDisconnected
  std::size_t size{0};
};

/// One recv() without waiting. End of stream and errors other than EAGAIN are kDisconnected; errno is 0 or the error
/// then.
[[nodiscard]] Received receive(int fd, std::span<std::byte> buffer) noexcept;

/// How a connection ended, by the errno of receive(), for a sentence that begins with the peer: "closed the
/// connection".
[[nodiscard]] const char* ending(int error) noexcept;

/// Hands the whole message to the kernel in one send() without waiting, never raising SIGPIPE.
/// kEmpty: nothing was sent (buffer full). A partly sent message ends the session: kDisconnected.
[[nodiscard]] IoStatus send_message(int fd, std::span<const std::byte> message) noexcept;

/// Waits for `fd` to become readable. False at the deadline. Errors count as readable (the next receive tells).
[[nodiscard]] bool wait_readable(int fd, TimePoint deadline) noexcept;

/// Sends everything, waiting where needed. Errors: kDisconnected, kTimeout.
[[nodiscard]] Status send_all(int fd, std::span<const std::byte> message, TimePoint deadline) noexcept;

}  // namespace embody::transport
