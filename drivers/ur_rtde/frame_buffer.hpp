#pragma once
// Cuts a byte stream into RTDE packages. Allocates once, at construction.
#include <algorithm>
#include <vector>

#include "drivers/ur_rtde/codec.hpp"

namespace embody::rtde {

class FrameBuffer {
 public:
  void clear() noexcept { begin_ = end_ = 0; }

  /// Where the next received bytes go; at least one largest package wide once next() has reported kIncomplete.
  /// Invalidates the frames that next() returned.
  [[nodiscard]] std::span<std::byte> space() noexcept {
    std::copy(bytes_.begin() + begin_, bytes_.begin() + end_, bytes_.begin());
    end_ -= begin_;
    begin_ = 0;
    return std::span(bytes_).subspan(static_cast<std::size_t>(end_));
  }

  /// Tells how many bytes were written into space().
  void commit(std::size_t size) noexcept { end_ += static_cast<std::ptrdiff_t>(size); }

  /// Takes the oldest package out; it stays readable until space() or clear().
  [[nodiscard]] ParsedFrame next() noexcept {
    const Bytes waiting =
        std::span(bytes_).subspan(static_cast<std::size_t>(begin_), static_cast<std::size_t>(end_ - begin_));
    const ParsedFrame parsed = parse_frame(waiting);
    begin_ += static_cast<std::ptrdiff_t>(parsed.size);
    return parsed;
  }

 private:
  std::vector<std::byte> bytes_{2 * kMaxPackageSize};
  std::ptrdiff_t begin_{0};
  std::ptrdiff_t end_{0};
};

}  // namespace embody::rtde
