// The free hand: skeletons from public anthropometry, with shape parameters that mean something to people.
#include "core/hand/builtin_mesh.hpp"

namespace embody::hand {
namespace {

using Eigen::Vector3d;

// Wrist (root joint) in M: MANO's origin lies near the knuckle of the middle finger. With this offset, calibrated
// transforms X_HM and X_PM made for MANO hold for this model.
Vector3d wrist_joint() {
  return {0.0957, 0.0064, 0.0062};
}

// First, second, third joint and fleshy tip of each finger (by Finger) in the flat hand, from the wrist, m.
using Bones = std::array<std::array<Vector3d, 4>, kFingers>;

Bones bones_of(Skeleton skeleton) {
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

/// d p / d shape for the point `level` (0..2 joints, 3 tip) of a finger.
Eigen::Matrix<double, 3, 10> directions(const std::array<Vector3d, 4>& bone, std::size_t finger, std::size_t level) {
  Eigen::Matrix<double, 3, 10> d = Eigen::Matrix<double, 3, 10>::Zero();
  const auto column = [&d](HandShape parameter) { return d.col(static_cast<Eigen::Index>(parameter)); };
  const auto length = static_cast<HandShape>(static_cast<std::size_t>(HandShape::kThumbLength) + finger);
  column(HandShape::kScale) = bone[level];
  column(HandShape::kPalmLength).x() = bone[0].x();
  column(HandShape::kGirth).y() = bone[0].y();
  column(HandShape::kPalmBreadth).z() = bone[0].z();
  column(length) = bone[level] - bone[0];
  if (level == 3) column(HandShape::kDistalLength) = bone[3] - bone[2];
  return d;
}

}  // namespace

HandData builtin_hand(Skeleton skeleton, Side side) {
  const Bones bones = bones_of(skeleton);
  HandData data;
  data.skeleton = skeleton;
  data.source = skeleton == Skeleton::kBoneLengths ? "built-in hand A" : "built-in hand B";
  data.joints_M.col(0) = wrist_joint();
  data.thickness_directions(static_cast<Eigen::Index>(HandShape::kScale)) = 1.0;
  data.thickness_directions(static_cast<Eigen::Index>(HandShape::kGirth)) = 1.0;
  for (std::size_t f = 0; f < kFingers; ++f) {
    for (std::size_t level = 0; level < 3; ++level) {
      const auto joint = static_cast<Eigen::Index>(first_joint(static_cast<Finger>(f)) + level);
      data.joints_M.col(joint) = wrist_joint() + bones[f][level];
      data.joint_directions.middleRows<3>(3 * joint) = directions(bones[f], f, level);
    }
    const auto tip = static_cast<Eigen::Index>(f);
    data.tips_M.col(tip) = wrist_joint() + bones[f][3];
    data.tip_directions.middleRows<3>(3 * tip) = directions(bones[f], f, 3);
  }
  add_builtin_mesh(data);
  return side == Side::kRight ? data : mirrored(data);
}

}  // namespace embody::hand
