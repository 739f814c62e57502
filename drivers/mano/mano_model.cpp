#include "drivers/mano/mano_model.hpp"

#include <array>
#include <cmath>

#include "core/hand/skinning.hpp"

namespace embody::mano {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr Index kJoints = static_cast<Index>(hand::kHandModelJoints);
constexpr Index kShapes = static_cast<Index>(hand::kHandShapeParameters);
constexpr std::array<Index, kFingers> kTipVertices{744, 320, 443, 554, 671};
constexpr std::size_t kAny = 0;  // any size from 1

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// An array of the file that has the wanted shape and only finite numbers.
Result<const Array*> find(const ArrayFile& file, const char* key, const std::vector<std::size_t>& shape) {
  const auto found = file.arrays.find(std::string_view(key));
  if (found == file.arrays.end()) return make_error(Errc::kMalformed, "%s is missing: is this a MANO model?", key);
  const Array& array = found->second;
  bool matches = array.shape.size() == shape.size();
  std::string expected;
  for (std::size_t i = 0; i < shape.size(); ++i) {
    matches = matches && (shape[i] == kAny ? array.shape[i] > 0 : array.shape[i] == shape[i]);
    expected += (i == 0 ? "" : "x") + (shape[i] == kAny ? std::string("any") : std::to_string(shape[i]));
  }
  if (!matches) {
    return make_error(Errc::kMalformed, "%s has shape %.60s; expected %s", key, shape_text(array.shape).c_str(),
                      expected.c_str());
  }
  for (std::size_t i = 0; i < array.values.size(); ++i) {
    if (!std::isfinite(array.values[i])) {
      return make_error(Errc::kMalformed, "%s holds a number that is not finite (element %zu)", key, i);
    }
  }
  return &array;
}

/// Rows x columns, as they are in memory.
Eigen::Map<const RowMajor> matrix(const Array& array, Index rows, Index columns) {
  return {array.values.data(), rows, columns};
}

/// The elements as indices below `limit`.
Result<std::vector<int>> indices(const Array& array, const char* key, std::size_t limit) {
  std::vector<int> out;
  out.reserve(array.values.size());
  for (const double value : array.values) {
    if (value < 0.0 || value >= static_cast<double>(limit) || value != std::floor(value)) {
      return make_error(Errc::kMalformed, "%s holds %g; expected whole numbers from 0 to %zu", key, value, limit - 1);
    }
    out.push_back(static_cast<int>(value));
  }
  return out;
}

Status read_triangles(const ArrayFile& file, ManoModel& model) {
  const auto array = find(file, "f", {kAny, 3});
  if (!array) return array.error();
  const auto count = static_cast<Index>((*array)->shape[0]);
  if (count > kMaxTriangles) {
    return make_error(Errc::kMalformed, "f has %td triangles; expected at most %td", static_cast<std::ptrdiff_t>(count),
                      static_cast<std::ptrdiff_t>(kMaxTriangles));
  }
  const auto corners = indices(**array, "f", static_cast<std::size_t>(kVertices));
  if (!corners) return corners.error();
  model.triangles = Eigen::Map<const Eigen::Matrix3Xi>(corners->data(), 3, count);
  return {};
}

/// Compressed sparse columns, 16 x 778 (scipy.sparse.csc_matrix).
Status read_sparse_regressor(const ArrayFile& file, ManoModel& model) {
  const auto data = find(file, "J_regressor.data", {kAny});
  if (!data) return data.error();
  const auto rows = find(file, "J_regressor.indices", {(*data)->shape[0]});
  if (!rows) return rows.error();
  const auto starts = find(file, "J_regressor.indptr", {static_cast<std::size_t>(kVertices) + 1});
  if (!starts) return starts.error();
  const auto row = indices(**rows, "J_regressor.indices", hand::kHandModelJoints);
  if (!row) return row.error();
  const auto start = indices(**starts, "J_regressor.indptr", (*data)->shape[0] + 1);
  if (!start) return start.error();
  bool ordered = start->front() == 0 && start->back() == static_cast<int>((*data)->shape[0]);
  for (std::size_t i = 1; i < start->size(); ++i) ordered = ordered && (*start)[i - 1] <= (*start)[i];
  if (!ordered) {
    return make_error(Errc::kMalformed, "J_regressor.indptr does not rise from 0 to the %zu elements of the data",
                      (*data)->shape[0]);
  }
  model.joint_regressor.setZero(kJoints, kVertices);
  for (Index column = 0; column < kVertices; ++column) {
    const auto c = static_cast<std::size_t>(column);
    for (auto i = static_cast<std::size_t>((*start)[c]); i < static_cast<std::size_t>((*start)[c + 1]); ++i) {
      model.joint_regressor((*row)[i], column) += (*data)->values[i];
    }
  }
  return {};
}

Status read_regressor(const ArrayFile& file, ManoModel& model) {
  if (file.arrays.count("J_regressor.data") > 0) return read_sparse_regressor(file, model);
  const auto array = find(file, "J_regressor", {hand::kHandModelJoints, static_cast<std::size_t>(kVertices)});
  if (!array) return array.error();
  model.joint_regressor = matrix(**array, kJoints, kVertices);
  return {};
}

Status read_weights(const ArrayFile& file, ManoModel& model) {
  constexpr double kTolerance = 1e-3, kExact = 1e-12;  // between them: single precision, made exact
  const auto array = find(file, "weights", {static_cast<std::size_t>(kVertices), hand::kHandModelJoints});
  if (!array) return array.error();
  model.weights = matrix(**array, kVertices, kJoints);
  for (Index v = 0; v < kVertices; ++v) {
    const double sum = model.weights.row(v).sum();
    if (std::abs(sum - 1.0) > kTolerance || model.weights.row(v).minCoeff() < -kTolerance) {
      return make_error(Errc::kMalformed, "weights of vertex %td sum to %g; expected 1, and none of them negative",
                        static_cast<std::ptrdiff_t>(v), sum);
    }
    if (std::abs(sum - 1.0) > kExact) model.weights.row(v) /= sum;
  }
  return {};
}

Status check_tree(const ArrayFile& file) {
  const auto array = find(file, "kintree_table", {2, hand::kHandModelJoints});
  if (!array) return array.error();
  const auto& values = (*array)->values;
  for (std::size_t k = 0; k < hand::kHandModelJoints; ++k) {
    const double parent = values[k], joint = values[hand::kHandModelJoints + k];
    const bool root = parent < 0.0 || parent >= static_cast<double>(hand::kHandModelJoints);  // -1, often unsigned
    const bool right_parent = k == 0 ? root : parent == static_cast<double>(hand::parent_joint(k));
    if (!right_parent || joint != static_cast<double>(k)) {
      return make_error(Errc::kMalformed, "kintree_table gives joint %g the parent %g; MANO's joint %zu has %s %zu",
                        joint, parent, k, k == 0 ? "none, not" : "parent", hand::parent_joint(k));
    }
  }
  return {};
}

/// The side that the fingers point to.
Status find_side(const ArrayFile& file, ManoModel& model) {
  const Vector3d wrist = model.template_M * model.joint_regressor.row(0).transpose();
  const Vector3d hand = model.template_M.col(kTipVertices[2]) - wrist;
  const double length_m = hand.norm();
  if (!(length_m > .05 && length_m < .5)) {
    return make_error(Errc::kMalformed, "v_template is a hand of %g m from wrist to middle finger tip; expected metres",
                      length_m);
  }
  if (std::abs(hand.x()) < .7 * length_m) {
    return make_error(Errc::kMalformed, "the fingers of v_template do not point along x; expected MANO's own frame");
  }
  model.side = hand.x() < 0.0 ? Side::kRight : Side::kLeft;
  const char* found = model.side == Side::kRight ? "right" : "left";
  if (!file.side.empty() && file.side != found) {
    return make_error(Errc::kMalformed, "side is %s, but v_template is a %s hand", file.side.c_str(), found);
  }
  return {};
}

}  // namespace

Result<ManoModel> make_model(const ArrayFile& file) {
  constexpr auto kRows = static_cast<std::size_t>(kVertices);
  ManoModel model;
  const auto vertices = find(file, "v_template", {kRows, 3});
  if (!vertices) return vertices.error();
  model.template_M = matrix(**vertices, kVertices, 3).transpose();
  if (const auto status = read_triangles(file, model); !status) return status.error();
  if (const auto status = read_regressor(file, model); !status) return status.error();
  if (const auto status = read_weights(file, model); !status) return status.error();
  if (const auto status = check_tree(file); !status) return status.error();

  const auto correctives = find(file, "posedirs", {kRows, 3, static_cast<std::size_t>(hand::kPoseCorrectives)});
  if (!correctives) return correctives.error();
  model.pose_correctives = matrix(**correctives, 3 * kVertices, hand::kPoseCorrectives);
  const auto shapes = find(file, "shapedirs", {kRows, 3, kAny});
  if (!shapes) return shapes.error();
  const auto components = static_cast<Index>((*shapes)->shape[2]);
  if (components < kShapes) {
    return make_error(Errc::kMalformed, "shapedirs has shape %s; expected 778x3x10 or more components",
                      shape_text((*shapes)->shape).c_str());
  }
  model.shape_directions = matrix(**shapes, 3 * kVertices, components).leftCols(kShapes);
  if (const auto status = find_side(file, model); !status) return status.error();
  return model;
}

hand::HandData hand_data(const ManoModel& model, const std::string& source) {
  hand::HandData data;
  data.side = model.side;
  data.source = source;
  data.joints_M = model.template_M * model.joint_regressor.transpose();
  for (Index parameter = 0; parameter < kShapes; ++parameter) {
    const Eigen::Matrix3Xd moved = model.shape_directions.col(parameter).reshaped(3, kVertices);
    data.joint_directions.col(parameter) = (moved * model.joint_regressor.transpose()).reshaped();
  }
  for (std::size_t f = 0; f < kFingers; ++f) {
    const auto finger = static_cast<Index>(f);
    data.tips_M.col(finger) = model.template_M.col(kTipVertices[f]);
    data.tip_directions.middleRows<3>(3 * finger) = model.shape_directions.middleRows<3>(3 * kTipVertices[f]);
  }
  data.mesh.vertices_M = model.template_M;
  data.mesh.shape_directions = model.shape_directions;
  data.mesh.pose_correctives = model.pose_correctives;
  data.mesh.weights = model.weights;
  data.mesh.triangles = model.triangles;
  data.mesh.contact_vertices = hand::contact_patches(data);
  return data;
}

}  // namespace embody::mano
