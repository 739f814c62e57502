#pragma once
// What a hand model is made of, in MANO's parametrisation (Romero, Tzionas, Black 2017): rest joints and surface that
// are linear in ten shape parameters, skinning weights, and pose correctives. Two sources fill it: the free built-in
// hand (builtin_hand.cpp) and a user's own MANO files (drivers/mano). Frame M: fingers -x, dorsal +y, thumb +z for a
// right hand; a left hand is its mirror image in x. Metres.
#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/hal/types.hpp"

namespace embody::hand {

inline constexpr std::size_t kHandModelJoints = 16;  ///< wrist, then 3 per finger: index, middle, little, ring, thumb
inline constexpr std::size_t kHandShapeParameters = 10;
inline constexpr Eigen::Index kPoseCorrectives = 135;  ///< row-major R - I of joints 1..15

using Vector48 = Eigen::Matrix<double, 48, 1>;
using Shape = Eigen::Matrix<double, static_cast<int>(kHandShapeParameters), 1>;

/// First of the three joints of a finger in MANO's order of 16 joints.
[[nodiscard]] constexpr std::size_t first_joint(Finger finger) noexcept {
  return 1 + kFingerOffset[static_cast<std::size_t>(finger)] / 3;
}
/// The joint before `joint` in the tree; the wrist (0) is its own parent.
[[nodiscard]] constexpr std::size_t parent_joint(std::size_t joint) noexcept {
  return joint % 3 == 1 ? 0 : (joint == 0 ? 0 : joint - 1);
}

/// A triangle mesh of V vertices that is skinned to the joints. V may be 0: no surface.
struct HandMesh {
  Eigen::Matrix3Xd vertices_M;                              ///< 3 x V, flat hand, zero shape
  Eigen::MatrixXd shape_directions;                         ///< 3V x 10, rows x0 y0 z0 x1 ...: d vertices / d shape
  Eigen::MatrixXd pose_correctives;                         ///< 3V x 135, same rows; 0 x 0: none
  Eigen::MatrixXd weights;                                  ///< V x 16, rows sum to 1
  Eigen::Matrix3Xi triangles;                               ///< outward normals by the right-hand rule
  std::array<std::vector<int>, kFingers> contact_vertices;  ///< palmar patch of each finger

  [[nodiscard]] Eigen::Index size() const noexcept { return vertices_M.cols(); }
};

enum class Skeleton {
  kBoneLengths,  ///< mean bone lengths of 66 X-rays (Buryanov & Kotiuk 2010), hand length 190.7 mm to the middle tip
  kWebXr,        ///< joints of the WebXR generic hand asset (MIT), hand length 190.2 mm
};

struct HandData {
  Side side{Side::kRight};
  std::optional<Skeleton> skeleton;  ///< of the built-in hand; nothing for a user's model
  std::string source;                ///< for people
  Eigen::Matrix<double, 3, 16> joints_M{Eigen::Matrix<double, 3, 16>::Zero()};            ///< flat hand, zero shape
  Eigen::Matrix<double, 48, 10> joint_directions{Eigen::Matrix<double, 48, 10>::Zero()};  ///< d joints / d shape
  Eigen::Matrix<double, 3, 5> tips_M{Eigen::Matrix<double, 3, 5>::Zero()};                ///< fleshy tips, by Finger
  Eigen::Matrix<double, 15, 10> tip_directions{Eigen::Matrix<double, 15, 10>::Zero()};    ///< d tips / d shape
  Shape thickness_directions{Shape::Zero()};  ///< d (distance from the bones, relative) / d shape
  HandMesh mesh;
};

/// Shape parameters of the built-in hand: relative changes, e.g. 0.05 = 5 % more. All zero is the reference skeleton.
enum class HandShape : std::size_t {
  kScale,        ///< everything, about the wrist
  kPalmBreadth,  ///< knuckles across the palm (z)
  kPalmLength,   ///< knuckles along the palm (x)
  kThumbLength,  ///< phalanges of a finger, along the finger
  kIndexLength,
  kMiddleLength,
  kRingLength,
  kLittleLength,
  kGirth,         ///< thickness of the surface about the bones, height of the knuckles (y)
  kDistalLength,  ///< last phalanx of every finger, on top of the finger's length
};

/// The free hand: own numbers, own surface, no licence to mind. Allocates.
[[nodiscard]] HandData builtin_hand(Skeleton skeleton, Side side);

/// The same hand on the other side: mirrored in x.
[[nodiscard]] HandData mirrored(const HandData& data);

/// Rotation vectors of the mirrored hand: (x, y, z) becomes (x, -y, -z) joint by joint. Its own inverse.
template <class Angles>
void mirror_angles(Eigen::MatrixBase<Angles>& q_rad) noexcept {
  for (Eigen::Index i = 0; i < q_rad.size(); ++i) {
    if (i % 3 != 0) q_rad(i) = -q_rad(i);
  }
}

/// A point that moves with the hand.
struct HandPoint {
  enum class Kind : std::uint8_t {
    kBone,     ///< fixed to the bone that turns with `joint`, `offset_m` from that joint in the flat hand
    kSurface,  ///< on the mesh: `barycentric` in the triangle of `vertices`, plus `offset_m`, skinned
    kJoint,    ///< the centre of `joint`
    kTip,      ///< the fleshy tip of the finger
  };
  Kind kind{Kind::kBone};
  std::size_t joint{0};   ///< MANO's order
  bool stretches{false};  ///< kBone: `offset_m` is for zero shape and stretches along the bone with its length
  std::array<int, 3> vertices{};
  std::array<double, 3> barycentric{1.0, 0.0, 0.0};
  Eigen::Vector3d offset_m{0.0, 0.0, 0.0};
};

}  // namespace embody::hand
