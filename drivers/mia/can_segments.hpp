#pragma once
// Messages of up to 111 bytes in CAN frames without ISO-TP and without flow control. Pure functions over bytes.
// This layout is our own ("user-defined CAN profile, not a Prensilia specification"):
//   byte 0 of each frame   sequence << 4 | index; the sequence counts messages of one direction modulo 16,
//                          the index counts frames of a message from 0
//   bytes 1..7             up to seven bytes of the message
// A frame with less than seven bytes of the message ends it (it may have none). So the 15 bytes of a command make
// three frames: 7 + 7 + 1.
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "core/base/time.hpp"

namespace embody::mia {

inline constexpr std::size_t kSegmentBytes = 7;
inline constexpr std::size_t kMaxSegments = 16;
inline constexpr std::size_t kMaxMessage = kSegmentBytes * (kMaxSegments - 1) + kSegmentBytes - 1;

struct Segment {
  std::uint8_t size{0};  ///< 1..8
  std::array<std::uint8_t, 8> data{};
};
struct Segments {
  std::size_t count{0};
  std::array<Segment, kMaxSegments> frames{};
};

/// The frames of `message`, in order; none when it has no byte or more than kMaxMessage.
[[nodiscard]] Segments split_message(std::string_view message, unsigned sequence) noexcept;

/// Joins frames to messages. A message whose frames do not come complete, in order, once each and within `timeout` of
/// its first one is dropped, and so is, within that time, one that comes again or was overtaken by a later one. Bytes
/// of two messages never mix: the sequence comes round again only after 16 messages, and `timeout` is to be shorter
/// than these take.
class SegmentAssembler {
 public:
  explicit SegmentAssembler(Duration timeout) noexcept : timeout_(timeout) {}

  /// Takes the data of one frame that arrived at `now`; the message when it is complete, valid until the next push().
  std::optional<std::string_view> push(std::span<const std::uint8_t> frame, TimePoint now) noexcept;
  /// Messages given up, and frames that belong to none.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  [[nodiscard]] bool outdated(unsigned sequence, TimePoint now) const noexcept;
  void drop() noexcept;

  Duration timeout_;
  std::array<char, kMaxMessage> text_{};
  std::size_t size_{0};
  unsigned next_index_{0};  ///< 0: no message has begun
  unsigned sequence_{0};
  TimePoint t_first_{};
  std::optional<unsigned> last_sequence_;  ///< of the last complete message
  TimePoint t_last_{};
  std::uint64_t dropped_{0};
};

}  // namespace embody::mia
