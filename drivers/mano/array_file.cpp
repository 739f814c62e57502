#include "drivers/mano/array_file.hpp"

#include <algorithm>
#include <array>

namespace embody::mano {

bool is_wanted(std::string_view key) noexcept {
  constexpr std::array<std::string_view, 10> kKeys{
      "v_template",         "f",        "J_regressor.data", "J_regressor",  "weights", "J_regressor.indices",
      "J_regressor.indptr", "posedirs", "shapedirs",        "kintree_table"};
  return std::find(kKeys.begin(), kKeys.end(), key) != kKeys.end();
}

std::string shape_text(const std::vector<std::size_t>& shape) {
  if (shape.empty()) return "a single number";
  std::string text;
  for (const std::size_t n : shape) text += (text.empty() ? "" : "x") + std::to_string(n);
  return text;
}

}  // namespace embody::mano
