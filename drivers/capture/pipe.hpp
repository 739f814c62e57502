#pragma once
// One direction of a proxied link: bytes that are on their way from one descriptor to another. Non-blocking.
#include <sys/types.h>

#include <array>
#include <cstddef>
#include <functional>
#include <span>

namespace embody::capture {

/// Neither loses nor reorders bytes: while the receiver is full, nothing is read from the sender.
class Pipe {
 public:
  /// read() and write() of the descriptors: negative is -errno.
  using Read = ssize_t (*)(int fd, std::span<std::byte> buffer);
  using Write = ssize_t (*)(int fd, std::span<const std::byte> bytes);
  using Tap = std::function<void(std::span<const std::byte>)>;

  enum class State {
    kOpen,
    kEnded,         ///< the sender has ended and the receiver has everything
    kSenderBroken,  ///< error, or hang-up of a serial line
    kReceiverBroken,
  };

  Pipe(Read read, Write write) : read_(read), write_(write) {}

  /// Moves what there is without waiting, at most some 256 KiB. `tap` sees each chunk just before the receiver gets it,
  /// so that a capture holds all that its ends have seen.
  State move(int from, int to, const Tap& tap);

  [[nodiscard]] bool waits_for_receiver() const noexcept { return !pending_.empty(); }
  [[nodiscard]] bool reads() const noexcept { return pending_.empty() && !ended_; }

 private:
  bool flush(int to);

  Read read_;
  Write write_;
  std::array<std::byte, std::size_t{16} * 1024> buffer_{};
  std::span<const std::byte> pending_;  // of the buffer
  bool ended_{false};
};

/// For sockets.
ssize_t read_socket(int fd, std::span<std::byte> buffer);
ssize_t write_socket(int fd, std::span<const std::byte> bytes);
/// For terminals; the end of the far side reads as -EIO.
ssize_t read_terminal(int fd, std::span<std::byte> buffer);
ssize_t write_terminal(int fd, std::span<const std::byte> bytes);

}  // namespace embody::capture
