#include "core/hand/hand_model.hpp"

#include "core/math/so3_jacobian.hpp"

namespace embody::hand {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

Index idx(std::size_t i) noexcept {
  return static_cast<Index>(i);
}

/// Row-major R - I of the finger's three joints: what pose correctives multiply.
Eigen::Matrix<double, 27, 1> corrective_features(const FingerChain& chain) noexcept {
  Eigen::Matrix<double, 27, 1> features;
  for (std::size_t level = 0; level < 3; ++level) {
    const Matrix3d R = chain.R_M_parent[level].transpose() * chain.R_MJ[level];
    for (Index row = 0; row < 3; ++row) {
      for (Index col = 0; col < 3; ++col)
        features(9 * idx(level) + 3 * row + col) = R(row, col) - (row == col ? 1.0 : 0.0);
    }
  }
  return features;
}

}  // namespace

HandModel::HandModel()
    : HandModel(builtin_hand(Skeleton::kBoneLengths, Side::kRight), Shape::Zero(),
                default_points(builtin_hand(Skeleton::kBoneLengths, Side::kRight))) {}

HandModel::HandModel(const HandData& data, const Shape& shape, const HandPoints& points) : side_(data.side) {
  for (std::size_t k = 0; k < kHandModelJoints; ++k) {
    joints_[k] = data.joints_M.col(idx(k)) + data.joint_directions.middleRows<3>(3 * idx(k)) * shape;
  }
  for (std::size_t f = 0; f < kFingers; ++f) {
    tips_[f] = data.tips_M.col(idx(f)) + data.tip_directions.middleRows<3>(3 * idx(f)) * shape;
  }
  for (std::size_t f = 0; f < kFingers; ++f) {
    for (const HandPoint& point : points[f]) points_[f].push_back(make_point(data, shape, f, point));
  }
}

HandModel::Point HandModel::make_point(const HandData& data, const Shape& shape, std::size_t finger,
                                       const HandPoint& given) const {
  const std::size_t first = first_joint(static_cast<Finger>(finger));
  Point point;
  point.correctives.setZero();
  const std::size_t level = given.joint - first;
  switch (given.kind) {
    case HandPoint::Kind::kBone: {
      Vector3d p_J = given.offset_m;
      if (given.stretches) {
        const Vector3d end =
            level == 2 ? Vector3d(data.tips_M.col(idx(finger))) : Vector3d(data.joints_M.col(idx(given.joint + 1)));
        const Vector3d bone = end - data.joints_M.col(idx(given.joint));
        const Vector3d shaped = (level == 2 ? tips_[finger] : joints_[given.joint + 1]) - joints_[given.joint];
        const Vector3d along = p_J.dot(bone) / bone.squaredNorm() * bone;
        const double thickness = 1.0 + data.thickness_directions.dot(shape);
        p_J = shaped.norm() / bone.norm() * along + thickness * (p_J - along);
      }
      point.terms.push_back({static_cast<int>(level), 1.0, p_J});
      break;
    }
    case HandPoint::Kind::kJoint: {
      const Vector3d centre = joints_[given.joint];
      if (level == 0) point.terms.push_back({-1, 1.0, centre});
      if (level > 0) point.terms.push_back({static_cast<int>(level) - 1, 1.0, centre - joints_[given.joint - 1]});
      break;
    }
    case HandPoint::Kind::kTip:
      point.terms.push_back({2, 1.0, tips_[finger] - joints_[first + 2]});
      break;
    case HandPoint::Kind::kSurface: {
      std::array<Term, 4> terms;  // palm and other fingers at rest, then the finger's joints
      for (int l = 0; l < 4; ++l) terms[static_cast<std::size_t>(l)] = {l - 1, 0.0, Vector3d::Zero()};
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const Index v = given.vertices[corner];
        const double b = given.barycentric[corner];
        if (b == 0.0) continue;
        const Vector3d p =
            data.mesh.vertices_M.col(v) + data.mesh.shape_directions.middleRows<3>(3 * v) * shape + given.offset_m;
        for (std::size_t k = 0; k < kHandModelJoints; ++k) {
          const bool own = k >= first && k <= first + 2;
          Term& term = terms[own ? k - first + 1 : 0];
          const double weight = b * data.mesh.weights(v, idx(k));
          term.weight += weight;
          term.p_J += weight * (own ? Vector3d(p - joints_[k]) : p);
        }
        if (data.mesh.pose_correctives.size() > 0) {
          point.corrected = true;
          point.correctives += b * data.mesh.pose_correctives.block<3, 27>(3 * v, 9 * (idx(first) - 1));
        }
      }
      for (const Term& term : terms) {
        if (term.weight != 0.0) point.terms.push_back(term);
      }
      break;
    }
  }
  return point;
}

std::array<Pose, kHandModelJoints> HandModel::joint_poses(const Vector48& q_rad) const noexcept {
  std::array<Pose, kHandModelJoints> X_MJ;
  for (std::size_t k = 0; k < kHandModelJoints; ++k) {
    const std::size_t parent = parent_joint(k);
    const Pose X_PJ =
        math::pose_from(k == 0 ? joints_[0] : Vector3d(joints_[k] - joints_[parent]), q_rad.segment<3>(3 * idx(k)));
    X_MJ[k] = k == 0 ? X_PJ : X_MJ[parent] * X_PJ;
  }
  return X_MJ;
}

std::size_t HandModel::joints_moving(Finger finger, std::size_t point) const noexcept {
  int levels = 0;
  for (const Term& term : at(finger, point).terms) levels = std::max(levels, term.level + 1);
  return static_cast<std::size_t>(levels);
}

FingerChain HandModel::chain(Finger finger, const Vector9& q_rad) const noexcept {
  const std::size_t first = first_joint(finger);
  FingerChain out;
  out.q_rad = q_rad;
  out.centres_M[0] = joints_[first];
  Matrix3d R = Matrix3d::Identity();  // of the parent; the wrist is at rest
  for (std::size_t level = 0; level < 3; ++level) {
    const Vector3d w = q_rad.segment<3>(3 * idx(level));
    if (level > 0)
      out.centres_M[level] = out.centres_M[level - 1] + R * (joints_[first + level] - joints_[first + level - 1]);
    out.R_M_parent[level] = R;
    out.axes_M.middleCols<3>(3 * idx(level)) = R * math::left_jacobian_so3(w);
    R = R * math::exp_so3(w);
    out.R_MJ[level] = R;
  }
  return out;
}

Vector3d HandModel::point(Finger finger, std::size_t index, const FingerChain& chain) const noexcept {
  const Point& point = at(finger, index);
  Vector3d correction = Vector3d::Zero();
  if (point.corrected) correction = point.correctives * corrective_features(chain);
  Vector3d p = Vector3d::Zero();
  for (const Term& term : point.terms) {
    const Vector3d p_J = term.p_J + term.weight * correction;
    if (term.level < 0) {
      p += p_J;
    } else {
      const auto level = static_cast<std::size_t>(term.level);
      p += term.weight * chain.centres_M[level] + chain.R_MJ[level] * p_J;
    }
  }
  return p;
}

PointJacobian HandModel::jacobian(Finger finger, std::size_t index, const FingerChain& chain) const noexcept {
  const Point& point = at(finger, index);
  Vector3d correction = Vector3d::Zero();
  if (point.corrected) correction = point.correctives * corrective_features(chain);
  PointJacobian J = PointJacobian::Zero();
  Matrix3d R_blend = Matrix3d::Zero();
  for (const Term& term : point.terms) {
    if (term.level < 0) {
      R_blend += term.weight * Matrix3d::Identity();
      continue;
    }
    const auto level = static_cast<std::size_t>(term.level);
    R_blend += term.weight * chain.R_MJ[level];
    const Vector3d lever = chain.R_MJ[level] * (term.p_J + term.weight * correction);
    for (std::size_t l = 0; l <= level; ++l) {
      const Vector3d u = term.weight * (chain.centres_M[level] - chain.centres_M[l]) + lever;
      for (Index i = 3 * idx(l); i < 3 * idx(l + 1); ++i) J.col(i) += chain.axes_M.col(i).cross(u);
    }
  }
  if (point.corrected) {
    for (std::size_t level = 0; level < 3; ++level) {
      const Matrix3d R = chain.R_M_parent[level].transpose() * chain.R_MJ[level];
      const Matrix3d axes = chain.R_M_parent[level].transpose() * chain.axes_M.middleCols<3>(3 * idx(level));
      for (Index i = 0; i < 3; ++i) {
        Eigen::Matrix<double, 9, 1> dR;  // row-major derivative of the joint's rotation
        for (Index col = 0; col < 3; ++col) {
          const Vector3d d = axes.col(i).cross(R.col(col));
          for (Index row = 0; row < 3; ++row) dR(3 * row + col) = d(row);
        }
        J.col(3 * idx(level) + i) += R_blend * (point.correctives.middleCols<9>(9 * idx(level)) * dR);
      }
    }
  }
  return J;
}

void HandModel::add_curvature(Finger finger, std::size_t index, const FingerChain& chain, const Vector3d& c,
                              Matrix9& curvature) const noexcept {
  // With axes w_a, w_b of joints A <= B and lever u from joint B: d2p/da db = w_a x (w_b x u), plus (dw_a/db) x u when
  // A = B.
  for (const Term& term : at(finger, index).terms) {
    if (term.level < 0) continue;
    const auto last = static_cast<std::size_t>(term.level);
    const Vector3d lever = chain.R_MJ[last] * term.p_J;
    for (std::size_t B = 0; B <= last; ++B) {
      const Vector3d u = term.weight * (chain.centres_M[last] - chain.centres_M[B]) + lever;
      for (Index b = 3 * idx(B); b < 3 * idx(B + 1); ++b) {
        const Vector3d d = chain.axes_M.col(b).cross(u).cross(c);  // c . (w_a x v) = w_a . (v x c)
        for (Index a = 0; a < 3 * idx(B + 1); ++a) {
          const double s = chain.axes_M.col(a).dot(d);
          curvature(a, b) += s;
          if (a < 3 * idx(B)) curvature(b, a) += s;
        }
      }
      const Vector3d m = chain.R_M_parent[B].transpose() * u.cross(c);
      curvature.block<3, 3>(3 * idx(B), 3 * idx(B)) +=
          math::left_jacobian_derivative_so3(chain.q_rad.segment<3>(3 * idx(B)), m);
    }
  }
}

std::array<Vector3d, 2> HandModel::distal(Finger finger, const FingerChain& chain) const noexcept {
  const Vector3d along_J = tips_[static_cast<std::size_t>(finger)] - joints_[first_joint(finger) + 2];
  return {chain.centres_M[2], chain.centres_M[2] + chain.R_MJ[2] * along_J};
}

std::array<Vector3d, 2> HandModel::finger_points(Finger finger, const Vector9& q_rad) const noexcept {
  const FingerChain at_q = chain(finger, q_rad);
  return {point(finger, 0, at_q), point(finger, 1, at_q)};
}

}  // namespace embody::hand
