#pragma once
// The other end of a replayed link, if it is in this process.
#include <string>

namespace embody::capture {

/// Is `fd` the far end of the TCP socket `ours`, or (when `device` is not empty) an open `device`?
[[nodiscard]] bool is_far_end(int fd, int ours, const std::string& device);
/// A descriptor of this process for which is_far_end() holds; -1: none.
[[nodiscard]] int find_far_end(int ours, const std::string& device);
/// Bytes that wait to be read there; negative: unknown.
[[nodiscard]] int unread_bytes(int fd) noexcept;

}  // namespace embody::capture
