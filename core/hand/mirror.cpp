// The hand on the other side.
#include "core/hand/hand_data.hpp"

namespace embody::hand {
namespace {

/// Flips the x rows of stacked points x0 y0 z0 x1 ...
template <class Rows>
void flip_x(Rows& rows) {
  for (Eigen::Index i = 0; i < rows.rows(); i += 3) rows.row(i) *= -1.0;
}

}  // namespace

HandData mirrored(const HandData& data) {
  HandData out = data;
  out.side = data.side == Side::kRight ? Side::kLeft : Side::kRight;
  flip_x(out.joints_M);
  flip_x(out.joint_directions);
  flip_x(out.tips_M);
  flip_x(out.tip_directions);
  flip_x(out.mesh.vertices_M);
  flip_x(out.mesh.shape_directions);
  flip_x(out.mesh.pose_correctives);
  // A mirrored rotation is S R S with S = diag(-1, 1, 1): elements with exactly one index x change their sign.
  for (Eigen::Index column = 0; column < out.mesh.pose_correctives.cols(); ++column) {
    const Eigen::Index row = column % 9 / 3, col = column % 3;
    if ((row == 0) != (col == 0)) out.mesh.pose_correctives.col(column) *= -1.0;
  }
  out.mesh.triangles.row(1).swap(out.mesh.triangles.row(2));  // keeps normals outward
  return out;
}

}  // namespace embody::hand
