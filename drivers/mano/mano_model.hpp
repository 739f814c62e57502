#pragma once
// A hand model in MANO's parametrisation (Romero, Tzionas, Black 2017) as its files hold it, checked.
#include <Eigen/Core>
#include <string>

#include "core/base/result.hpp"
#include "core/hand/hand_data.hpp"
#include "drivers/mano/array_file.hpp"

namespace embody::mano {

inline constexpr Eigen::Index kVertices = 778;
inline constexpr Eigen::Index kMaxTriangles = 4096;  ///< MANO has 1538; variants close the wrist with some more

/// Sizes are fixed, all numbers finite, weights of a vertex sum to 1, corners of triangles exist.
struct ManoModel {
  Side side{Side::kRight};
  Eigen::Matrix3Xd template_M;       ///< 3 x 778, flat hand, m
  Eigen::Matrix3Xi triangles;        ///< 3 x T
  Eigen::MatrixXd joint_regressor;   ///< 16 x 778: joints from vertices
  Eigen::MatrixXd weights;           ///< 778 x 16
  Eigen::MatrixXd pose_correctives;  ///< 2334 x 135, rows x0 y0 z0 x1 ...
  Eigen::MatrixXd shape_directions;  ///< 2334 x 10
};

/// Checks everything and assembles the model. Of more than ten shape directions the first ten are used. The side is the
/// one the fingers point to (right hand: -x); `file.side` must agree. Errors: kMalformed, one sentence with key,
/// expected and found shape.
[[nodiscard]] Result<ManoModel> make_model(const ArrayFile& file);

/// The model as the rest of the product uses it: joints by the regressor, also as a function of the shape; tips at the
/// vertices that smplx uses for them (744 320 443 554 671 from thumb to little finger); contact patches by
/// hand::contact_patches(). `source` is for people.
[[nodiscard]] hand::HandData hand_data(const ManoModel& model, const std::string& source);

/// JSON in the layout of dfki-ric/hand_embodiment's mano_{left,right}.json, with a key "side" on top. Reading it gives
/// the same model, bit by bit. About 10 MB.
[[nodiscard]] std::string format_model(const ManoModel& model);

}  // namespace embody::mano
