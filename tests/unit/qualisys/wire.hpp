#pragma once
// The tests' own writer of QTM packets in either byte order, made from the protocol's tables and not from the codec.
#include <string_view>
#include <vector>

#include "core/hal/types.hpp"
#include "drivers/qualisys/byte_order.hpp"

namespace embody::test {

using Bytes = std::vector<std::byte>;
using qualisys::ByteOrder;

/// A component of one frame: its type number and what it carries, in millimetres.
struct WirePart {
  std::uint32_t type{0};
  std::vector<std::vector<float>> items;  ///< the numbers of each item, in the order of the protocol
  Bytes raw;                              ///< instead of items: everything behind the component's type
};

struct WireFrame {
  std::uint64_t timestamp_us{0};
  std::uint32_t number{1};
  std::uint16_t drop_rate_permille{0};
  std::uint16_t out_of_sync_permille{0};
  std::vector<WirePart> parts;
};

[[nodiscard]] Bytes wire_data(const WireFrame& frame, ByteOrder order);
[[nodiscard]] Bytes wire_text(std::uint32_t type, std::string_view text, ByteOrder order);
[[nodiscard]] Bytes wire_event(unsigned event, ByteOrder order);
[[nodiscard]] Bytes wire_no_more_data(ByteOrder order);

/// Numbers of one body: position, then the rotation column by column; `residual_mm` < 0: none.
[[nodiscard]] std::vector<float> wire_body(const Pose& X_W, float residual_mm);
/// What QTM sends for something it does not see: `count` numbers with all bits set.
[[nodiscard]] std::vector<float> wire_missing(std::size_t count);

}  // namespace embody::test
