// Any byte stream in either byte order, in chunks chosen by its first byte: every packet that comes out decodes or is
// refused, and what decodes is sound; markers survive encoding.
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "core/math/pose.hpp"
#include "drivers/qualisys/codec.hpp"
#include "drivers/qualisys/stream_reassembler.hpp"

namespace {

using namespace embody::qualisys;

void check_markers(const DataPacket& data) {
  constexpr Component kComponents[] = {Component::k3d};
  DataPacket again;
  if (!decode_data(encode_data(data, kComponents), again)) std::abort();
  if (again.markers.size() != data.markers.size() || again.timestamp_us != data.timestamp_us) std::abort();
  for (std::size_t i = 0; i < data.markers.size(); ++i) {
    const auto& marker = data.markers[i];
    if (marker.visible && !marker.p_W.allFinite()) std::abort();
    if (!(marker.confidence >= 0.0F && marker.confidence <= 1.0F)) std::abort();
    if (marker.visible != again.markers[i].visible) std::abort();
  }
}

void check_data(std::span<const std::byte> packet, ByteOrder order) {
  DataPacket data;
  if (const auto status = decode_data(packet, data, order); !status) {
    if (status.error().detail.empty()) std::abort();
    return;
  }
  if (data.markers.size() > kMaxDataMarkers || data.bodies.size() > kMaxDataBodies) std::abort();
  check_markers(data);
  for (const auto& body : data.bodies) {
    if (!body.visible) continue;
    const Eigen::Matrix3d R = body.X_W.linear();
    if (!((R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().sum() < 1e-9)) std::abort();
    if (!body.X_W.translation().allFinite() || !(body.residual_m >= 0.0) || R.determinant() < 0.0) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto order = (data[0] & 1) != 0 ? ByteOrder::kBig : ByteOrder::kLittle;
  const std::size_t chunk = 1 + data[0] / 2;
  auto rest = std::as_bytes(std::span(data + 1, size - 1));
  check_data(rest, order);
  StreamReassembler reassembler(8192, order);
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
      (void)decode_text(*packet, order);
      (void)decode_event(*packet, order);
      check_data(*packet, order);
    }
  }
  return 0;
}
