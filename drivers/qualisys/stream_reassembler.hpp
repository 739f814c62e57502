#pragma once
// Cuts a byte stream into QTM packets inside one fixed buffer: no heap after construction.
#include <cstddef>
#include <span>
#include <vector>

#include "core/base/result.hpp"
#include "drivers/qualisys/byte_order.hpp"

namespace embody::qualisys {

/// Usage: take packets until next() is empty, receive into free_space(), commit() what came, repeat.
class StreamReassembler {
 public:
  /// Packets of up to `capacity` bytes pass.
  explicit StreamReassembler(std::size_t capacity, ByteOrder order = ByteOrder::kLittle)
      : buffer_(capacity), order_(order) {}

  /// Where the next bytes belong; moves an unfinished packet to the front, so earlier packets become invalid. Not empty
  /// after next() returned an empty span.
  [[nodiscard]] std::span<std::byte> free_space() noexcept;
  /// `size` bytes were written into free_space().
  void commit(std::size_t size) noexcept;
  /// The next whole packet, valid until free_space(); empty when more bytes are needed.
  /// Errors: kMalformed (decode_header), kUnsupported (larger than the buffer). The stream cannot go on after an error.
  [[nodiscard]] Result<std::span<const std::byte>> next() noexcept;

 private:
  std::vector<std::byte> buffer_;
  ByteOrder order_;
  std::size_t begin_{0};  // first byte not yet handed out
  std::size_t end_{0};    // behind the last byte received
};

}  // namespace embody::qualisys
