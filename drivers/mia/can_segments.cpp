#include "drivers/mia/can_segments.hpp"

#include <algorithm>

namespace embody::mia {
namespace {

constexpr unsigned kMaxSequence = 16;

}  // namespace

Segments split_message(std::string_view message, unsigned sequence) noexcept {
  Segments segments;
  if (message.empty() || message.size() > kMaxMessage) return segments;
  segments.count = message.size() / kSegmentBytes + 1;
  for (std::size_t i = 0; i < segments.count; ++i) {
    const std::string_view part = message.substr(i * kSegmentBytes, kSegmentBytes);
    Segment& segment = segments.frames[i];
    segment.size = static_cast<std::uint8_t>(part.size() + 1);
    segment.data[0] = static_cast<std::uint8_t>((sequence % kMaxSequence) << 4 | i);
    std::copy(part.begin(), part.end(), segment.data.begin() + 1);
  }
  return segments;
}

std::optional<std::string_view> SegmentAssembler::push(std::span<const std::uint8_t> frame, TimePoint now) noexcept {
  if (frame.empty() || frame.size() > kSegmentBytes + 1) {
    drop();
    return std::nullopt;
  }
  const unsigned sequence = frame[0] >> 4;
  const unsigned index = frame[0] & 0xF;
  if (index == 0) {
    if (next_index_ != 0) drop();  // the rest of the last message never came
    size_ = 0;
    sequence_ = sequence;
    t_first_ = now;
  } else if (next_index_ != index || sequence_ != sequence || now - t_first_ > timeout_) {
    drop();
    return std::nullopt;
  }
  const auto part = frame.subspan(1);
  if (size_ + part.size() > text_.size()) {
    drop();
    return std::nullopt;
  }
  std::copy(part.begin(), part.end(), text_.begin() + static_cast<std::ptrdiff_t>(size_));
  size_ += part.size();
  next_index_ = index + 1;
  if (part.size() == kSegmentBytes) return std::nullopt;
  if (size_ == 0 || outdated(sequence, now)) {
    drop();
    return std::nullopt;
  }
  next_index_ = 0;
  last_sequence_ = sequence;
  t_last_ = now;
  return std::string_view(text_.data(), size_);
}

/// True for the last message or one of the eight before it, soon after: then it is a repetition, or overtaken.
bool SegmentAssembler::outdated(unsigned sequence, TimePoint now) const noexcept {
  if (!last_sequence_ || now - t_last_ > timeout_) return false;
  const unsigned ahead = (sequence - *last_sequence_) % kMaxSequence;
  return ahead == 0 || ahead >= kMaxSequence / 2;
}

void SegmentAssembler::drop() noexcept {
  next_index_ = 0;
  ++dropped_;
}

}  // namespace embody::mia
