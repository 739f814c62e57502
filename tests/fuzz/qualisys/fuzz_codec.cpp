// Any byte stream, in chunks chosen by its first bytes: every packet that comes out decodes or is refused, and data
// that decodes survives encoding.
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "drivers/qualisys/codec.hpp"
#include "drivers/qualisys/stream_reassembler.hpp"

namespace {

using namespace embody::qualisys;

void check_data(std::span<const std::byte> packet) {
  DataPacket data;
  if (!decode_data(packet, data)) return;
  constexpr Component kComponents[] = {Component::k3d};
  DataPacket again;
  if (!decode_data(encode_data(data, kComponents), again)) std::abort();
  if (again.markers.size() != data.markers.size() || again.timestamp_us != data.timestamp_us) std::abort();
  for (std::size_t i = 0; i < data.markers.size(); ++i) {
    if (data.markers[i].visible && !data.markers[i].p_W.allFinite()) std::abort();
    if (data.markers[i].visible != again.markers[i].visible) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::size_t chunk = 1 + data[0];
  auto rest = std::as_bytes(std::span(data + 1, size - 1));
  check_data(rest);
  StreamReassembler reassembler(8192);
  while (!rest.empty()) {
    const auto space = reassembler.free_space();
    if (space.empty()) std::abort();
    const std::size_t count = std::min({chunk, space.size(), rest.size()});
    std::copy_n(rest.begin(), count, space.begin());
    reassembler.commit(count);
    rest = rest.subspan(count);
    while (true) {
      const auto packet = reassembler.next();
      if (!packet) return 0;
      if (packet->empty()) break;
      (void)decode_text(*packet);
      (void)decode_event(*packet);
      check_data(*packet);
    }
  }
  return 0;
}
