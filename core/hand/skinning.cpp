#include "core/hand/skinning.hpp"

#include <Eigen/Geometry>

#include "core/math/pose.hpp"

namespace embody::hand {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

HandSkin::HandSkin(const HandData& data, const Shape& shape)
    : joints_(data.joints_M),
      rest_(data.mesh.vertices_M.reshaped()),
      correctives_(data.mesh.pose_correctives),
      triangles_(data.mesh.triangles),
      contact_vertices_(data.mesh.contact_vertices),
      vertices_(data.mesh.vertices_M),
      normals_(Eigen::Matrix3Xd::Zero(3, data.mesh.size())) {
  joints_.reshaped() += data.joint_directions * shape;
  if (data.mesh.size() > 0) rest_ += data.mesh.shape_directions * shape;
  corrected_ = rest_;
  for (Index v = 0; v < data.mesh.size(); ++v) {
    for (std::size_t k = 0; k < kHandModelJoints; ++k) {
      const double weight = data.mesh.weights(v, static_cast<Index>(k));
      if (weight != 0.0) influences_.push_back({k, weight});
    }
    influence_ends_.push_back(influences_.size());
  }
  for (std::size_t f = 0; f < kFingers; ++f) {
    contact_points_[f].resize(3, static_cast<Index>(contact_vertices_[f].size()));
  }
  step(Vector48::Zero());
  update_normals();
}

void HandSkin::step(const Vector48& q_rad) noexcept {
  std::array<Matrix3d, kHandModelJoints> R;  // of each bone in M
  std::array<Vector3d, kHandModelJoints> t;  // a point x of the flat hand moves with bone k to R_k x + t_k
  Eigen::Matrix<double, static_cast<int>(kPoseCorrectives), 1> features;
  for (std::size_t k = 0; k < kHandModelJoints; ++k) {
    const auto i = static_cast<Index>(k);
    const Matrix3d R_PJ = math::exp_so3(q_rad.segment<3>(3 * i));
    const Vector3d J = joints_.col(i);
    const std::size_t parent = parent_joint(k);
    const Vector3d centre = k == 0 ? J : Vector3d(R[parent] * J + t[parent]);
    R[k] = k == 0 ? R_PJ : Matrix3d(R[parent] * R_PJ);
    t[k] = centre - R[k] * J;
    if (k > 0) features.segment<9>(9 * (i - 1)) = (R_PJ - Matrix3d::Identity()).transpose().reshaped();
  }
  corrected_ = rest_;
  if (correctives_.size() > 0) corrected_.noalias() += correctives_ * features;

  std::size_t next = 0;
  for (Index v = 0; v < vertices_.cols(); ++v) {
    const Vector3d x = corrected_.segment<3>(3 * v);
    Vector3d p = Vector3d::Zero();
    for (; next < influence_ends_[static_cast<std::size_t>(v)]; ++next) {
      const auto& [joint, weight] = influences_[next];
      p += weight * (R[joint] * x + t[joint]);
    }
    vertices_.col(v) = p;
  }
  for (std::size_t f = 0; f < kFingers; ++f) {
    Index column = 0;
    for (const int v : contact_vertices_[f]) contact_points_[f].col(column++) = vertices_.col(v);
  }
}

void HandSkin::update_normals() noexcept {
  vertex_normals(vertices_, triangles_, normals_);
}

void vertex_normals(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& triangles,
                    Eigen::Matrix3Xd& normals) noexcept {
  normals.setZero();
  for (Index t = 0; t < triangles.cols(); ++t) {
    const Vector3d a = vertices.col(triangles(0, t));
    const Vector3d n = (vertices.col(triangles(1, t)) - a).cross(vertices.col(triangles(2, t)) - a);
    for (Index corner = 0; corner < 3; ++corner) normals.col(triangles(corner, t)) += n;
  }
  for (Index v = 0; v < normals.cols(); ++v) {
    const double norm = normals.col(v).norm();
    if (norm > 0.0) normals.col(v) /= norm;
  }
}

Vector3d dorsal_direction(Finger finger) noexcept {
  return finger == Finger::kThumb ? Vector3d(0.0, 1.0, 1.0).normalized() : Vector3d::UnitY();
}

std::array<std::vector<int>, kFingers> contact_patches(const HandData& data) {
  constexpr double kCosWidest = .5;
  std::array<std::vector<int>, kFingers> patches;
  Eigen::Matrix3Xd normals(3, data.mesh.size());
  vertex_normals(data.mesh.vertices_M, data.mesh.triangles, normals);
  for (std::size_t f = 0; f < kFingers; ++f) {
    const auto finger = static_cast<Finger>(f);
    const auto last = static_cast<Index>(first_joint(finger) + 2);
    const Vector3d along = (data.tips_M.col(static_cast<Index>(f)) - data.joints_M.col(last - 1)).normalized();
    const Vector3d dorsal = dorsal_direction(finger);
    const Vector3d palmar = -(dorsal - dorsal.dot(along) * along).normalized();
    for (Index v = 0; v < data.mesh.size(); ++v) {
      const double weight = data.mesh.weights(v, last - 1) + data.mesh.weights(v, last);
      if (weight > .5 && normals.col(v).dot(palmar) >= kCosWidest) patches[f].push_back(static_cast<int>(v));
    }
  }
  return patches;
}

}  // namespace embody::hand
