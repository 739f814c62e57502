#pragma once
// A message as the frames that ISO 15765-2 makes of it (classic, normal addressing), without flow control.
#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace embody::test {

/// The data of each frame. @param padded  to eight bytes of 0xCC
inline std::vector<std::vector<std::byte>> isotp_frames(std::span<const std::byte> message, bool padded) {
  std::vector<std::vector<std::byte>> frames;
  const auto add = [&](std::vector<std::byte> header, std::size_t room) {
    const auto part = message.first(std::min(room, message.size()));
    header.insert(header.end(), part.begin(), part.end());
    if (padded) header.resize(8, std::byte{0xCC});
    frames.push_back(std::move(header));
    message = message.subspan(part.size());
  };
  if (message.size() < 8) {
    add({static_cast<std::byte>(message.size())}, 7);
    return frames;
  }
  add({static_cast<std::byte>(0x10 | message.size() >> 8), static_cast<std::byte>(message.size() & 0xff)}, 6);
  for (unsigned number = 1; !message.empty(); ++number) add({static_cast<std::byte>(0x20 | (number & 0xf))}, 7);
  return frames;
}

}  // namespace embody::test
