#include "drivers/qualisys/stream_reassembler.hpp"

#include <algorithm>
#include <cstring>

#include "drivers/qualisys/codec.hpp"

namespace embody::qualisys {

std::span<std::byte> StreamReassembler::free_space() noexcept {
  if (begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  return std::span(buffer_).subspan(end_);
}

void StreamReassembler::commit(std::size_t size) noexcept {
  end_ = std::min(end_ + size, buffer_.size());
}

Result<std::span<const std::byte>> StreamReassembler::next() noexcept {
  const auto waiting = std::span<const std::byte>(buffer_).subspan(begin_, end_ - begin_);
  if (waiting.size() < kHeaderSize) return std::span<const std::byte>{};
  const auto header = decode_header(waiting, order_);
  if (!header) return header.error();
  if (header->size > buffer_.size()) {
    return make_error(Errc::kUnsupported, "QTM sent a packet of %zu bytes, more than the %zu handled here",
                      header->size, buffer_.size());
  }
  if (waiting.size() < header->size) return std::span<const std::byte>{};
  begin_ += header->size;
  return waiting.first(header->size);
}

}  // namespace embody::qualisys
