#pragma once
// The whole surface of a hand in any pose: linear blend skinning with pose correctives (Romero, Tzionas, Black 2017,
// section 3). For display and metrics; the record mapping needs single points only (hand_model.hpp).
#include <array>
#include <vector>

#include "core/hand/hand_data.hpp"

namespace embody::hand {

/// Surface of a hand of one shape. With joints J, vertices T and weights w, all of that shape:
///   T_p = T + P vec(R(q_1..15) - I),  G_k = G_parent(k) [R(q_k) | J_k - J_parent(k)],  v = sum_k w_k G_k [I | -J_k]
///   T_p
/// vec() is row by row; joint i's nine elements meet columns 9(i-1) .. 9i-1 of P. All memory is taken by the
/// constructor.
class HandSkin {
 public:
  HandSkin(const HandData& data, const Shape& shape);

  /// Moves the surface to the 48 pose parameters (rotation vectors in MANO's order, wrist first, rad). Without
  /// correctives some 50 us for a thousand vertices; MANO's correctives add 0.2 ms. No heap.
  void step(const Vector48& q_rad) noexcept;
  /// Computes the normals of the present pose. No heap.
  void update_normals() noexcept;

  /// 3 x V, M, m.
  [[nodiscard]] const Eigen::Matrix3Xd& vertices() const noexcept { return vertices_; }
  /// 3 x V, unit length, outward; of the last update_normals().
  [[nodiscard]] const Eigen::Matrix3Xd& normals() const noexcept { return normals_; }
  /// 3 x T, corners of the triangles.
  [[nodiscard]] const Eigen::Matrix3Xi& triangles() const noexcept { return triangles_; }
  /// The finger's contact patch in the present pose, M, m; one column per HandMesh::contact_vertices.
  [[nodiscard]] const Eigen::Matrix3Xd& contact_points(Finger finger) const noexcept {
    return contact_points_[static_cast<std::size_t>(finger)];
  }

 private:
  struct Influence {
    std::size_t joint{0};
    double weight{0.0};
  };

  Eigen::Matrix<double, 3, 16> joints_;
  Eigen::VectorXd rest_;  // 3V: x0 y0 z0 x1 ...
  Eigen::MatrixXd correctives_;
  Eigen::VectorXd corrected_;
  std::vector<Influence> influences_;        // vertex by vertex
  std::vector<std::size_t> influence_ends_;  // per vertex
  Eigen::Matrix3Xi triangles_;
  std::array<std::vector<int>, kFingers> contact_vertices_;
  Eigen::Matrix3Xd vertices_;
  Eigen::Matrix3Xd normals_;
  std::array<Eigen::Matrix3Xd, kFingers> contact_points_;
};

/// Unit normals of the vertices: mean of the adjacent triangles' normals, weighted by area; zero for a vertex without
/// area around it. `normals` must have the size of `vertices`. No heap.
void vertex_normals(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& triangles,
                    Eigen::Matrix3Xd& normals) noexcept;

/// Where the back of a finger faces in the flat hand, M: up for the fingers, up and away from the palm for the thumb.
/// Not exactly normal to the bones. The same for both sides.
[[nodiscard]] Eigen::Vector3d dorsal_direction(Finger finger) noexcept;

/// Palmar patch of each finger's last two phalanges: vertices that hang mostly on its last two joints and whose normal
/// in the flat hand is within 60 degrees of the palmar direction. Works for any surface, so contact patches mean the
/// same for the built-in hand and a user's. Allocates.
[[nodiscard]] std::array<std::vector<int>, kFingers> contact_patches(const HandData& data);

}  // namespace embody::hand
