// Any sequence of datagrams, in either byte order: frames that come out are whole, and go forward in time except where
// the clock is said to have started anew.
#include <cstdint>
#include <cstdlib>
#include <memory>

#include "drivers/qualisys/frame_assembler.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace embody::qualisys;
  if (size == 0) return 0;
  const bool bodies = (data[0] & 1) != 0, in_order = (data[0] & 2) != 0;
  const auto order = (data[0] & 4) != 0 ? ByteOrder::kBig : ByteOrder::kLittle;
  auto rest = std::as_bytes(std::span(data + 1, size - 1));
  static const auto packet = std::make_unique<DataPacket>();
  FrameAssembler assembler(bodies, in_order);
  embody::TimePoint t_arrival{};
  std::uint64_t last_us = 0, restarts = 0, frames = 0, packets = 0;
  while (rest.size() > 2) {  // each datagram: how long after the one before, how long, bytes
    const auto later = std::to_integer<unsigned>(rest[0]);
    const auto length = std::min<std::size_t>(std::to_integer<std::size_t>(rest[1]), rest.size() - 2);
    const auto datagram = rest.subspan(2, length);
    rest = rest.subspan(2 + length);
    t_arrival += std::chrono::milliseconds(later);
    if (!decode_data(datagram, *packet, order)) continue;
    ++packets;
    if (assembler.step(*packet, t_arrival) != Assembly::kWhole) continue;
    const DataPacket& frame = assembler.frame();
    if (!frame.has_markers || (bodies && !frame.has_bodies)) std::abort();
    if (frame.timestamp_us != packet->timestamp_us) std::abort();
    if (frames > 0 && frame.timestamp_us <= last_us && assembler.restarts() == restarts) std::abort();
    last_us = frame.timestamp_us;
    restarts = assembler.restarts();
    ++frames;
  }
  if (frames + assembler.useless() + assembler.incomplete() > packets) std::abort();
  return 0;
}
