#include "drivers/sim/qtm/rigid_body.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace embody::sim {
namespace {

using Points = Eigen::Matrix3Xd;

/// Frame of the definition in the world: see BodyFrame. False when the first three points lie on one line.
bool definition_frame(const Points& p_W, BodyFrame kind, Pose& X_WB) {
  const Eigen::Vector3d to_first = p_W.col(0) - p_W.col(2);
  const Eigen::Vector3d normal = to_first.cross(p_W.col(1) - p_W.col(2));
  if (!(normal.norm() > 1e-9)) return false;
  X_WB = Pose::Identity();
  if (kind == BodyFrame::kCentre) {
    X_WB.translation() = p_W.rowwise().mean();
    return true;
  }
  const Eigen::Vector3d y = normal.normalized();
  const Eigen::Vector3d z = to_first.normalized();
  X_WB.linear().col(0) = y.cross(z);
  X_WB.linear().col(1) = y;
  X_WB.linear().col(2) = z;
  X_WB.translation() = p_W.col(2);
  return true;
}

/// False when one of the markers is missing.
bool collect(std::span<const Marker> markers, const std::vector<std::size_t>& slots, Points& p_W) {
  p_W.resize(3, static_cast<Eigen::Index>(slots.size()));
  for (std::size_t i = 0; i < slots.size(); ++i) {
    if (!markers[slots[i]].visible) return false;
    p_W.col(static_cast<Eigen::Index>(i)) = markers[slots[i]].p_W;
  }
  return true;
}

}  // namespace

Result<RigidBody> RigidBody::define(const QtmBody& body, const Motion& motion) {
  RigidBody rigid;
  rigid.parameters_.name = body.name;
  if (body.markers.size() < 3) {
    return make_error(Errc::kInvalidArgument, "the body '%.60s' needs at least three markers", body.name.c_str());
  }
  for (const auto& name : body.markers) {
    const auto found = std::find(motion.marker_names.begin(), motion.marker_names.end(), name);
    if (found == motion.marker_names.end()) {
      return make_error(Errc::kInvalidArgument, "the body '%.60s' needs the marker '%.60s', which is not there",
                        body.name.c_str(), name.c_str());
    }
    rigid.slots_.push_back(static_cast<std::size_t>(found - motion.marker_names.begin()));
    rigid.parameters_.points.push_back({name, {}});
  }
  const std::size_t last = std::min(kSearchedFrames, motion.frames.value_or(kSearchedFrames));
  for (std::size_t k = 0; k < last; ++k) {
    Points p_W;
    Pose X_WB;
    if (!collect(motion.frame(k), rigid.slots_, p_W) || !definition_frame(p_W, body.frame, X_WB)) continue;
    const Pose X_BW = X_WB.inverse();
    for (std::size_t i = 0; i < rigid.slots_.size(); ++i) {
      rigid.parameters_.points[i].p_B = X_BW * Eigen::Vector3d(p_W.col(static_cast<Eigen::Index>(i)));
    }
    return rigid;
  }
  return make_error(Errc::kNotFound, "the markers of the body '%.60s' are never seen together, off one line",
                    body.name.c_str());
}

BodyPose RigidBody::pose(std::span<const Marker> markers) const {
  BodyPose body;
  Points p_W;
  if (!collect(markers, slots_, p_W)) return body;
  Points p_B(3, p_W.cols());
  for (Eigen::Index i = 0; i < p_B.cols(); ++i) p_B.col(i) = parameters_.points[static_cast<std::size_t>(i)].p_B;
  const Eigen::Vector3d centre_W = p_W.rowwise().mean();
  const Eigen::Vector3d centre_B = p_B.rowwise().mean();
  const Eigen::Matrix3d covariance = (p_W.colwise() - centre_W) * (p_B.colwise() - centre_B).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1.0, 1.0, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0);
  body.X_WB.linear() = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  body.X_WB.translation() = centre_W - body.X_WB.linear() * centre_B;
  const Points difference = p_W - ((body.X_WB.linear() * p_B).colwise() + body.X_WB.translation());
  body.residual_m = difference.colwise().norm().mean();
  body.tracked = true;
  return body;
}

}  // namespace embody::sim
