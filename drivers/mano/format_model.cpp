#include <charconv>
#include <type_traits>

#include "drivers/mano/mano_model.hpp"

namespace embody::mano {
namespace {

using Eigen::Index;

/// Shortest text that reads back as the same number.
template <class Number>
void append(std::string& text, Number value) {
  char digits[32];
  const auto [end, error] = std::to_chars(digits, digits + sizeof digits, value);
  text.append(digits, error == std::errc{} ? end : digits);
}

/// [x,y,...] of `size` elements, each appended by `element(i)`.
template <class Element>
void append_list(std::string& text, Index size, const Element& element) {
  text += '[';
  for (Index i = 0; i < size; ++i) {
    if (i > 0) text += ',';
    element(i);
  }
  text += ']';
}

template <class Derived>
void append_matrix(std::string& text, const Eigen::MatrixBase<Derived>& m) {
  append_list(text, m.rows(),
              [&](Index row) { append_list(text, m.cols(), [&](Index column) { append(text, m(row, column)); }); });
}

/// vertices x 3 x columns, from rows x0 y0 z0 x1 ...
void append_directions(std::string& text, const Eigen::MatrixXd& m) {
  append_list(text, m.rows() / 3, [&](Index v) { append_matrix(text, m.middleRows<3>(3 * v)); });
}

/// {data, indices, indptr} of compressed sparse columns.
void append_regressor(std::string& text, const Eigen::MatrixXd& m) {
  std::vector<double> data;
  std::vector<Index> rows, starts{0};
  for (Index column = 0; column < m.cols(); ++column) {
    for (Index row = 0; row < m.rows(); ++row) {
      if (m(row, column) == 0.0) continue;
      data.push_back(m(row, column));
      rows.push_back(row);
    }
    starts.push_back(static_cast<Index>(data.size()));
  }
  const auto list = [&text](const char* key, const auto& values) {
    text += key;
    append_list(text, static_cast<Index>(values.size()),
                [&](Index i) { append(text, values[static_cast<std::size_t>(i)]); });
  };
  list("{\"data\":", data);
  list(",\"indices\":", rows);
  list(",\"indptr\":", starts);
  text += '}';
}

}  // namespace

std::string format_model(const ManoModel& model) {
  std::string text = "{\"side\":";
  text += model.side == Side::kRight ? "\"right\"" : "\"left\"";
  text += ",\n\"v_template\":";
  append_matrix(text, model.template_M.transpose());
  text += ",\n\"f\":";
  append_matrix(text, model.triangles.transpose());
  text += ",\n\"J\":";
  append_matrix(text, (model.template_M * model.joint_regressor.transpose()).transpose().eval());
  text += ",\n\"J_regressor\":";
  append_regressor(text, model.joint_regressor);
  text += ",\n\"kintree_table\":";
  Eigen::Matrix<int, 2, static_cast<int>(hand::kHandModelJoints)> tree;
  for (int k = 0; k < tree.cols(); ++k) {
    tree(0, k) = k == 0 ? -1 : static_cast<int>(hand::parent_joint(static_cast<std::size_t>(k)));
    tree(1, k) = k;
  }
  append_matrix(text, tree);
  text += ",\n\"weights\":";
  append_matrix(text, model.weights);
  text += ",\n\"posedirs\":";
  append_directions(text, model.pose_correctives);
  text += ",\n\"shapedirs\":";
  append_directions(text, model.shape_directions);
  text += "}\n";
  return text;
}

}  // namespace embody::mano
