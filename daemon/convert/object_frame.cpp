#include "daemon/convert/object_frame.hpp"

#include <Eigen/Geometry>

namespace embody::convert {

std::optional<Pose> object_frame(const std::array<Marker, 3>& markers) noexcept {
  constexpr double kLeast_m = 1e-3;
  for (const Marker& marker : markers) {
    if (!marker.visible || !marker.p_W.allFinite()) return std::nullopt;
  }
  const Eigen::Vector3d along = markers[1].p_W - markers[0].p_W;
  const Eigen::Vector3d aside = markers[2].p_W - markers[0].p_W;
  if (along.norm() < kLeast_m) return std::nullopt;
  const Eigen::Vector3d x = along.normalized();
  const Eigen::Vector3d off_axis = aside - x.dot(aside) * x;
  if (off_axis.norm() < kLeast_m) return std::nullopt;
  const Eigen::Vector3d y = off_axis.normalized();
  Pose X_WO = Pose::Identity();
  X_WO.linear().col(0) = x;
  X_WO.linear().col(1) = y;
  X_WO.linear().col(2) = x.cross(y);
  X_WO.translation() = markers[0].p_W;
  return X_WO;
}

}  // namespace embody::convert
