#include "drivers/sim/qtm/frame_encoder.hpp"

#include <algorithm>
#include <cmath>

namespace embody::sim {
namespace {

constexpr std::size_t kFrameHeaderSize = 24;
constexpr double kMillimetres = 1e3;
constexpr double kDegrees = 57.29577951308232;
constexpr std::uint32_t kMissing = 0xFFFFFFFF;
constexpr std::uint32_t kCameraTime = 2;  // kind of time code

void put_vector(Writer& out, const Eigen::Vector3d& v, double scale) {
  for (int axis = 0; axis < 3; ++axis) out.f32(v[axis] * scale);
}
void put_missing(Writer& out, int numbers) {
  for (int i = 0; i < numbers; ++i) out.u32(kMissing);
}

/// Count and the health of the camera links: the head of the 2D, 3D and 6D components.
void put_head(Writer& out, const FrameData& frame, std::size_t count) {
  out.u32(static_cast<std::uint32_t>(count));
  out.u16(frame.drop_rate_permille);
  out.u16(frame.out_of_sync_permille);
}

void put_labelled(Writer& out, const FrameData& frame, bool residual) {
  put_head(out, frame, frame.markers.size());
  for (const Marker& marker : frame.markers) {
    if (marker.visible) {
      put_vector(out, marker.p_W, kMillimetres);
    } else {
      put_missing(out, 3);
    }
    if (residual) out.f32(marker.visible ? frame.residual_m * kMillimetres : 0.0);
  }
}

void put_unlabelled(Writer& out, const FrameData& frame, bool residual) {
  put_head(out, frame, frame.unlabelled.size());
  for (const UnlabelledMarker& marker : frame.unlabelled) {
    put_vector(out, marker.p_W, kMillimetres);
    out.u32(marker.id);
    if (residual) out.f32(frame.residual_m * kMillimetres);
  }
}

void put_bodies(Writer& out, const FrameData& frame, bool euler, bool residual) {
  put_head(out, frame, frame.bodies.size());
  for (const BodyPose& body : frame.bodies) {
    if (!body.tracked) {
      put_missing(out, 3 + (euler ? 3 : 9) + (residual ? 1 : 0));
      continue;
    }
    put_vector(out, body.X_WB.translation(), kMillimetres);
    const Eigen::Matrix3d R_WB = body.X_WB.linear();
    if (euler) {
      put_vector(out, roll_pitch_yaw(R_WB), kDegrees);
    } else {
      for (int column = 0; column < 3; ++column) put_vector(out, R_WB.col(column), 1.0);
    }
    if (residual) out.f32(body.residual_m * kMillimetres);
  }
}

void put_timecode(Writer& out, const FrameData& frame) {
  out.u32(frame.camera_time ? 1 : 0);
  if (!frame.camera_time) return;
  const std::uint64_t ticks = frame.timestamp_us * 10;  // 10 MHz
  out.u32(kCameraTime);
  out.u32(static_cast<std::uint32_t>(ticks >> 32));
  out.u32(static_cast<std::uint32_t>(ticks));
}

void put_body(Writer& out, const FrameData& frame, Component component) {
  switch (component) {
    case Component::k3d:
    case Component::k3dResidual:
      return put_labelled(out, frame, component == Component::k3dResidual);
    case Component::k3dNoLabels:
    case Component::k3dNoLabelsResidual:
      return put_unlabelled(out, frame, component == Component::k3dNoLabelsResidual);
    case Component::k6d:
    case Component::k6dResidual:
      return put_bodies(out, frame, false, component == Component::k6dResidual);
    case Component::k6dEuler:
    case Component::k6dEulerResidual:
      return put_bodies(out, frame, true, component == Component::k6dEulerResidual);
    case Component::k2d:
    case Component::k2dLinear:
      return put_head(out, frame, 0);
    case Component::kTimecode:
      return put_timecode(out, frame);
    default:
      return out.u32(0);  // no such devices
  }
}

/// Writes the size, now known, at `offset`.
void patch_size(Bytes& bytes, std::size_t offset, std::size_t size, ByteOrder order) {
  Bytes word;
  Writer(word, order).u32(static_cast<std::uint32_t>(size));
  std::copy(word.begin(), word.end(), bytes.begin() + static_cast<std::ptrdiff_t>(offset));
}

}  // namespace

Eigen::Vector3d roll_pitch_yaw(const Eigen::Matrix3d& R) noexcept {
  const double pitch = std::asin(std::clamp(R(0, 2), -1.0, 1.0));
  // Looking along the middle axis, roll and yaw turn about one line: all of it is roll.
  if (std::abs(R(0, 2)) > 1.0 - 1e-12) return {std::atan2(R(2, 1), R(1, 1)), pitch, 0.0};
  return {std::atan2(-R(1, 2), R(2, 2)), pitch, std::atan2(-R(0, 1), R(0, 0))};
}

Bytes encode_frame(const FrameData& frame, std::span<const Component> components, ByteOrder order) {
  Bytes bytes;
  bytes.reserve(kFrameHeaderSize + components.size() * (16 + 20 * frame.markers.size()));
  Writer out(bytes, order);
  out.header(0, Packet::kData);
  out.u64(frame.timestamp_us);
  out.u32(frame.frame_number);
  out.u32(static_cast<std::uint32_t>(components.size()));
  for (const Component component : components) {
    const std::size_t begin = bytes.size();
    out.u32(0);
    out.u32(static_cast<std::uint32_t>(component));
    put_body(out, frame, component);
    patch_size(bytes, begin, bytes.size() - begin, order);
  }
  patch_size(bytes, 0, bytes.size(), order);
  return bytes;
}

}  // namespace embody::sim
