#include "drivers/capture/isotp_messages.hpp"

#include <algorithm>
#include <map>
#include <span>

namespace embody::capture {
namespace {

using Bytes = std::vector<std::byte>;

constexpr std::size_t kIdBytes = 4;

/// A message of one identifier that is under way.
struct Partial {
  Bytes bytes;  ///< with the identifier
  std::size_t size{0};
  unsigned next{1};
};

void append(Bytes& bytes, std::span<const std::byte> more) {
  bytes.insert(bytes.end(), more.begin(), more.end());
}

/// Joins the frames of one connection.
class Joiner {
 public:
  /// Takes one frame, identifier first; true when `message` is complete.
  Result<bool> take(const Bytes& frame, Bytes& message) {
    const std::span<const std::byte> data = std::span(frame).subspan(kIdBytes);
    if (data.empty()) return make_error(Errc::kMalformed, "a frame without data is none of ISO-TP");
    const unsigned first = std::to_integer<unsigned>(data[0]);
    const Bytes id(frame.begin(), frame.begin() + kIdBytes);
    switch (first >> 4) {
      case 0:
        return single(id, first & 0xf, data, message);
      case 1:
        return begin(id, first & 0xf, data);
      case 2:
        return consecutive(id, first & 0xf, data, message);
      case 3:
        return false;  // flow control
      default:
        return make_error(Errc::kMalformed, "a frame that begins with 0x%02x is none of ISO-TP", first);
    }
  }

 private:
  Result<bool> single(const Bytes& id, std::size_t size, std::span<const std::byte> data, Bytes& message) {
    if (size == 0 || size >= data.size()) {
      return make_error(Errc::kMalformed, "a single frame of %zu bytes cannot hold %zu", data.size(), size);
    }
    partial_.erase(id);
    message = id;
    append(message, data.subspan(1, size));
    return true;
  }

  Result<bool> begin(const Bytes& id, std::size_t high, std::span<const std::byte> data) {
    const std::size_t size = data.size() == 8 ? high << 8 | std::to_integer<std::size_t>(data[1]) : 0;
    if (size < 8) return make_error(Errc::kMalformed, "a first frame has eight bytes and a message more than seven");
    Partial& partial = partial_[id] = {id, size};
    append(partial.bytes, data.subspan(2));
    return false;
  }

  Result<bool> consecutive(const Bytes& id, unsigned number, std::span<const std::byte> data, Bytes& message) {
    const auto found = partial_.find(id);
    if (found == partial_.end()) return false;  // the capture began in the middle of a message
    Partial& partial = found->second;
    const std::size_t left = partial.size + kIdBytes - partial.bytes.size();
    if (number != partial.next || data.size() - 1 < std::min<std::size_t>(left, 7)) {
      return make_error(Errc::kMalformed, "consecutive frame %u comes where %u of a message was due", number,
                        partial.next);
    }
    append(partial.bytes, data.subspan(1, std::min<std::size_t>(left, 7)));
    partial.next = (partial.next + 1) & 0xf;
    if (left > 7) return false;
    message = std::move(partial.bytes);
    partial_.erase(found);
    return true;
  }

  std::map<Bytes, Partial> partial_;
};

}  // namespace

Result<Capture> join_isotp(const Capture& frames) {
  if (frames.header.link != LinkKind::kCan) {
    return make_error(Errc::kInvalidArgument, "a capture of %s has no ISO-TP",
                      kLinkKindNames[static_cast<std::size_t>(frames.header.link)]);
  }
  Capture messages{frames.header, {}};
  std::map<std::uint32_t, Joiner> joiners;  // by connection
  for (std::size_t i = 0; i < frames.chunks.size(); ++i) {
    Chunk chunk = frames.chunks[i];
    if (chunk.event == Event::kIn || chunk.event == Event::kOut) {
      if (chunk.bytes.size() < kIdBytes) return make_error(Errc::kMalformed, "chunk %zu is no CAN frame", i + 1);
      const auto complete = joiners[chunk.connection].take(frames.chunks[i].bytes, chunk.bytes);
      if (!complete) return make_error(Errc::kMalformed, "chunk %zu: %s", i + 1, complete.error().detail.c_str());
      if (!*complete) continue;
    }
    messages.chunks.push_back(std::move(chunk));
  }
  return messages;
}

}  // namespace embody::capture
