#include <bit>
#include <cmath>

#include "drivers/qualisys/codec.hpp"

namespace embody::qualisys {
namespace {

constexpr std::size_t kDataHeaderSize = 24;
constexpr std::size_t kComponentHeaderSize = 8;
constexpr std::size_t kItemsHeaderSize = 16;  // of the 3D and 6D families
constexpr double kMetresPerMillimetre = 1e-3;

/// One component, header included.
struct Part {
  std::span<const std::byte> bytes;
  Component type{};
  ByteOrder order{};

  [[nodiscard]] double number(std::size_t offset) const noexcept {
    return static_cast<double>(std::bit_cast<float>(load<std::uint32_t>(bytes, offset, order)));
  }
  [[nodiscard]] Eigen::Vector3d vector(std::size_t offset) const noexcept {
    return {number(offset), number(offset + 4), number(offset + 8)};
  }
};

std::size_t stride_of(Component type) noexcept {
  switch (type) {
    case Component::k3d:
      return 12;
    case Component::k3dResidual:
      return 16;
    case Component::k6d:
      return 48;
    case Component::k6dResidual:
      return 52;
  }
  return 0;
}

Marker load_marker(const Part& part, std::size_t offset) noexcept {
  const Eigen::Vector3d p_W = kMetresPerMillimetre * part.vector(offset);
  if (!p_W.allFinite()) return {};
  if (part.type == Component::k3d) return {p_W, true};
  return {p_W, true, confidence_of(kMetresPerMillimetre * part.number(offset + 12))};
}

/// Makes a nearly orthonormal matrix exact. False: it is no rotation.
bool make_rotation(Eigen::Matrix3d& R) noexcept {
  constexpr double kTolerance = 0.01;  // floats are good to 1e-7; beyond this the numbers mean something else
  if (!R.allFinite()) return false;
  if (!((R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kTolerance)) return false;
  if (R.col(0).cross(R.col(1)).dot(R.col(2)) <= 0.0) return false;
  R.col(0).normalize();
  R.col(2) = R.col(0).cross(R.col(1)).normalized();
  R.col(1) = R.col(2).cross(R.col(0));
  return true;
}

RigidBody load_body(const Part& part, std::size_t offset) noexcept {
  RigidBody body;
  const Eigen::Vector3d p_W = kMetresPerMillimetre * part.vector(offset);
  Eigen::Matrix3d R;
  for (int axis = 0; axis < 3; ++axis) R.col(axis) = part.vector(offset + 12 + 12 * static_cast<std::size_t>(axis));
  if (!p_W.allFinite() || !make_rotation(R)) return body;
  body.X_W.translation() = p_W;
  body.X_W.linear() = R;
  if (part.type == Component::k6dResidual) {
    const double residual_m = kMetresPerMillimetre * part.number(offset + 48);
    body.residual_m = residual_m >= 0.0 && std::isfinite(residual_m) ? residual_m : 0.0;
  }
  body.visible = true;
  return body;
}

/// Checks the size of a component of the 3D or 6D family and returns its number of items.
Result<std::size_t> count_items(const Part& part, std::size_t most, const char* family, const char* items) noexcept {
  if (part.bytes.size() < kItemsHeaderSize) {
    return make_error(Errc::kMalformed, "QTM %s component of %zu bytes is shorter than its header", family,
                      part.bytes.size());
  }
  const std::size_t count = load<std::uint32_t>(part.bytes, 8, part.order);
  if (count > most) {
    return make_error(Errc::kUnsupported, "QTM sends %zu %s, this program handles %zu", count, items, most);
  }
  if (part.bytes.size() != kItemsHeaderSize + count * stride_of(part.type)) {
    return make_error(Errc::kMalformed, "QTM %s component of %zu bytes does not hold %zu %s", family, part.bytes.size(),
                      count, items);
  }
  return count;
}

Status decode_markers(const Part& part, DataPacket& data) noexcept {
  const auto count = count_items(part, kMaxDataMarkers, "3D", "labelled markers");
  if (!count) return count.error();
  data.has_markers = true;
  data.markers.resize(*count);
  for (std::size_t i = 0; i < *count; ++i) {
    data.markers[i] = load_marker(part, kItemsHeaderSize + i * stride_of(part.type));
  }
  return {};
}

Status decode_bodies(const Part& part, DataPacket& data) noexcept {
  const auto count = count_items(part, kMaxDataBodies, "6D", "rigid bodies");
  if (!count) return count.error();
  data.has_bodies = true;
  data.bodies.resize(*count);
  for (std::size_t i = 0; i < *count; ++i) {
    data.bodies[i] = load_body(part, kItemsHeaderSize + i * stride_of(part.type));
  }
  return {};
}

Status decode_component(const Part& part, DataPacket& data) noexcept {
  const bool markers = part.type == Component::k3d || part.type == Component::k3dResidual;
  const bool bodies = part.type == Component::k6d || part.type == Component::k6dResidual;
  if (!markers && !bodies) return {};
  if (const auto status = markers ? decode_markers(part, data) : decode_bodies(part, data); !status) return status;
  data.drop_rate_permille = load<std::uint16_t>(part.bytes, 12, part.order);
  data.out_of_sync_permille = load<std::uint16_t>(part.bytes, 14, part.order);
  return {};
}

}  // namespace

float confidence_of(double residual_m) noexcept {
  constexpr double kGoodMetres = 0.002;
  if (!(residual_m > kGoodMetres)) return 1.0F;
  return static_cast<float>((kGoodMetres / residual_m) * (kGoodMetres / residual_m));
}

Status decode_data(std::span<const std::byte> packet, DataPacket& data, ByteOrder order) noexcept {
  const auto header = decode_whole(packet, order);
  if (!header) return header.error();
  if (header->type != PacketType::kData || header->size < kDataHeaderSize) {
    return make_error(Errc::kMalformed, "QTM data packet of type %u and %zu bytes", static_cast<unsigned>(header->type),
                      header->size);
  }
  data.timestamp_us = load<std::uint64_t>(packet, 8, order);
  data.frame_number = load<std::uint32_t>(packet, 16, order);
  data.has_markers = data.has_bodies = false;
  data.drop_rate_permille = data.out_of_sync_permille = 0;
  data.markers.clear();
  data.bodies.clear();
  if (data.timestamp_us > kMaxTimestampUs) return make_error(Errc::kMalformed, "QTM time stamp out of range");
  const std::size_t components = load<std::uint32_t>(packet, 20, order);
  auto rest = packet.subspan(kDataHeaderSize);
  for (std::size_t i = 0; i < components; ++i) {
    const std::size_t size = rest.size() < kComponentHeaderSize ? 0 : load<std::uint32_t>(rest, 0, order);
    if (size < kComponentHeaderSize || size > rest.size()) {
      return make_error(Errc::kMalformed, "QTM data component %zu of %zu does not fit into its packet", i + 1,
                        components);
    }
    const Part part{rest.first(size), static_cast<Component>(load<std::uint32_t>(rest, 4, order)), order};
    if (const auto status = decode_component(part, data); !status) return status;
    rest = rest.subspan(size);
  }
  if (!rest.empty()) return make_error(Errc::kMalformed, "QTM data packet has %zu bytes too many", rest.size());
  return {};
}

}  // namespace embody::qualisys
