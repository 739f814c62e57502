#include "drivers/capture/pipe.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>

namespace embody::capture {
namespace {

constexpr int kChunksPerMove = 16;  // so that one busy link does not keep the others waiting

bool is_transient(ssize_t result) {
  return result == -EAGAIN || result == -EWOULDBLOCK || result == -EINTR;
}

ssize_t or_errno(ssize_t result) {
  return result < 0 ? -errno : result;
}

}  // namespace

Pipe::State Pipe::move(int from, int to, const Tap& tap) {
  for (int i = 0; i < kChunksPerMove; ++i) {
    if (!flush(to)) return State::kReceiverBroken;
    if (!pending_.empty()) return State::kOpen;
    if (ended_) return State::kEnded;
    const ssize_t size = read_(from, buffer_);
    if (is_transient(size)) return State::kOpen;
    if (size < 0) return State::kSenderBroken;
    if (size == 0) {
      ended_ = true;
      return State::kEnded;
    }
    const std::span<const std::byte> chunk(buffer_.data(), static_cast<std::size_t>(size));
    tap(chunk);
    pending_ = chunk;
  }
  return State::kOpen;
}

/// False: the receiver is broken.
bool Pipe::flush(int to) {
  while (!pending_.empty()) {
    const ssize_t size = write_(to, pending_);
    if (is_transient(size)) return true;
    if (size <= 0) return false;
    pending_ = pending_.subspan(static_cast<std::size_t>(size));
  }
  return true;
}

ssize_t read_socket(int fd, std::span<std::byte> buffer) {
  return or_errno(::recv(fd, buffer.data(), buffer.size(), MSG_DONTWAIT));
}
ssize_t write_socket(int fd, std::span<const std::byte> bytes) {
  return or_errno(::send(fd, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL));
}
ssize_t read_terminal(int fd, std::span<std::byte> buffer) {
  const ssize_t size = ::read(fd, buffer.data(), buffer.size());
  return size == 0 ? -EIO : or_errno(size);
}
ssize_t write_terminal(int fd, std::span<const std::byte> bytes) {
  return or_errno(::write(fd, bytes.data(), bytes.size()));
}

}  // namespace embody::capture
