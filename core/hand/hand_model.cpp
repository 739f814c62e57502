#include "core/hand/hand_model.hpp"

#include <algorithm>

#include "core/math/so3_jacobian.hpp"

namespace embody::hand {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Wrist (root joint) in M: MANO's origin lies near the knuckle of the middle finger. With this offset, calibrated
// transforms X_HM and X_PM made for MANO hold for this model.
Vector3d wrist_joint() noexcept {
  return {0.0957, 0.0064, 0.0062};
}

// First, second, third joint and fleshy tip of each finger (by Finger) in the flat hand, from the wrist, m.
using FingerPoints = std::array<std::array<Vector3d, 4>, kFingers>;

FingerPoints skeleton_points(Skeleton skeleton) noexcept {
  if (skeleton == Skeleton::kWebXr) {
    return {
        {{{{-.0360, -.0192, .0280}, {-.0592, -.0343, .0450}, {-.0831, -.0437, .0669}, {-.0974, -.0524, .0852}}},
         {{{-.0885, -.0073, .0236}, {-.1338, -.0106, .0220}, {-.1579, -.0128, .0207}, {-.1804, -.0116, .0182}}},
         {{{-.0916, -.0025, .0017}, {-.1381, -.0070, -.0026}, {-.1654, -.0098, -.0057}, {-.1899, -.0077, -.0090}}},
         {{{-.0847, -.0065, -.0175}, {-.1263, -.0109, -.0268}, {-.1519, -.0142, -.0332}, {-.1749, -.0157, -.0378}}},
         {{{-.0739, -.0137, -.0351}, {-.1074, -.0181, -.0424}, {-.1264, -.0210, -.0490}, {-.1472, -.0224, -.0543}}}}};
  }
  return {{{{{-.0200, -.0120, .0250}, {-.0523, -.0268, .0546}, {-.0776, -.0344, .0719}, {-.1006, -.0398, .0856}}},
           {{{-.0955, -.0035, .0225}, {-.1353, -.0035, .0225}, {-.1577, -.0035, .0225}, {-.1773, -.0035, .0225}}},
           {{{-.0985, .0, .0015}, {-.1431, .0, -.0008}, {-.1694, .0, -.0022}, {-.1907, .0, -.0033}}},
           {{{-.0915, -.0030, -.0185}, {-.1325, -.0030, -.0243}, {-.1579, -.0030, -.0278}, {-.1789, -.0030, -.0308}}},
           {{{-.0800, -.0090, -.0360}, {-.1118, -.0090, -.0439}, {-.1293, -.0090, -.0483}, {-.1484, -.0090, -.0531}}}}};
}

double factor(const HandModelConfig& config, HandShape parameter) noexcept {
  return 1.0 + config.shape(static_cast<Eigen::Index>(parameter));
}

HandShape length_of(std::size_t finger) noexcept {
  return static_cast<HandShape>(static_cast<std::size_t>(HandShape::kThumbLength) + finger);
}

}  // namespace

HandModel::HandModel(const HandModelConfig& config) noexcept {
  const FingerPoints reference = skeleton_points(config.skeleton);
  const double scale = factor(config, HandShape::kScale);
  const double girth = factor(config, HandShape::kGirth);
  const Vector3d palm(factor(config, HandShape::kPalmLength), girth, factor(config, HandShape::kPalmBreadth));
  joints_[0] = wrist_joint();
  for (std::size_t f = 0; f < kFingers; ++f) {
    const std::size_t first = first_joint(static_cast<Finger>(f));
    const double length = factor(config, length_of(f));
    const std::array<double, 3> stretch{length, length, length * factor(config, HandShape::kDistalLength)};
    joints_[first] = joints_[0] + scale * reference[f][0].cwiseProduct(palm);
    for (std::size_t level = 0; level < 3; ++level) {
      const Vector3d end =
          joints_[first + level] + scale * stretch[level] * (reference[f][level + 1] - reference[f][level]);
      (level < 2 ? joints_[first + level + 1] : tips_[f]) = end;
    }
    for (std::size_t point = 0; point < 2; ++point) {
      const MarkerAttachment& given = config.attachments[f][point];
      const std::size_t level = std::clamp(given.joint, first, first + 2) - first;
      const Vector3d bone = (reference[f][level + 1] - reference[f][level]).normalized();
      const Vector3d p = given.p_rest_M - joints_[0] - reference[f][level];
      const Vector3d along = p.dot(bone) * bone;
      attachments_[f][point] = {level, scale * (stretch[level] * along + girth * (p - along))};
    }
  }
}

std::array<Pose, kHandModelJoints> HandModel::joint_poses(const Vector48& q_rad) const noexcept {
  std::array<Pose, kHandModelJoints> X_MJ;
  for (std::size_t k = 0; k < kHandModelJoints; ++k) {
    const Pose X_PJ = math::pose_from(k == 0 ? joints_[0] : Vector3d(joints_[k] - joints_[k % 3 == 1 ? 0 : k - 1]),
                                      q_rad.segment<3>(3 * static_cast<Eigen::Index>(k)));
    X_MJ[k] = k == 0 ? X_PJ : X_MJ[k % 3 == 1 ? 0 : k - 1] * X_PJ;
  }
  return X_MJ;
}

std::array<Vector3d, 2> HandModel::finger_points(Finger finger, const Vector9& q_rad) const noexcept {
  return finger_kinematics(finger, q_rad).p_M;
}

FingerKinematics HandModel::finger_kinematics(Finger finger, const Vector9& q_rad) const noexcept {
  const std::size_t first = first_joint(finger);
  FingerKinematics out;
  out.q_rad = q_rad;
  out.centres_M[0] = joints_[first];
  Matrix3d R = Matrix3d::Identity();  // of the parent; the wrist is at rest
  std::array<Matrix3d, 3> R_MJ;
  for (std::size_t level = 0; level < 3; ++level) {
    const Vector3d w = q_rad.segment<3>(3 * static_cast<Eigen::Index>(level));
    if (level > 0)
      out.centres_M[level] = out.centres_M[level - 1] + R * (joints_[first + level] - joints_[first + level - 1]);
    out.R_M_parent[level] = R;
    out.axes_M.middleCols<3>(3 * static_cast<Eigen::Index>(level)) = R * math::left_jacobian_so3(w);
    R = R * math::exp_so3(w);
    R_MJ[level] = R;
  }
  for (std::size_t point = 0; point < 2; ++point) {
    const Attachment& attachment = attachments_[static_cast<std::size_t>(finger)][point];
    out.level[point] = attachment.level;
    out.p_M[point] = out.centres_M[attachment.level] + R_MJ[attachment.level] * attachment.p_J;
    out.J[point].setZero();
    for (std::size_t i = 0; i < 3 * (attachment.level + 1); ++i) {
      const auto column = static_cast<Eigen::Index>(i);
      out.J[point].col(column) = out.axes_M.col(column).cross(out.p_M[point] - out.centres_M[i / 3]);
    }
  }
  return out;
}

void add_curvature(const FingerKinematics& kinematics, std::size_t point, const Vector3d& c,
                   Matrix9& curvature) noexcept {
  // With axes w_a, w_b of joints A <= B and lever u from joint B: d2p/da db = w_a x (w_b x u), plus (dw_a/db) x u when
  // A = B.
  const auto n = 3 * static_cast<Eigen::Index>(kinematics.level[point] + 1);
  for (Eigen::Index a = 0; a < n; ++a) {
    const Vector3d c_w = c.cross(kinematics.axes_M.col(a));
    for (Eigen::Index b = a / 3 * 3; b < n; ++b) {
      const double s = c_w.dot(kinematics.J[point].col(b));
      curvature(a, b) += s;
      if (b / 3 != a / 3) curvature(b, a) += s;
    }
  }
  for (Eigen::Index level = 0; 3 * level < n; ++level) {
    const auto l = static_cast<std::size_t>(level);
    const Vector3d lever = kinematics.p_M[point] - kinematics.centres_M[l];
    const Vector3d m = kinematics.R_M_parent[l].transpose() * lever.cross(c);
    curvature.block<3, 3>(3 * level, 3 * level) +=
        math::left_jacobian_derivative_so3(kinematics.q_rad.segment<3>(3 * level), m);
  }
}

}  // namespace embody::hand
