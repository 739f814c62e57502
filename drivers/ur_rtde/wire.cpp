#include "drivers/ur_rtde/wire.hpp"

namespace embody::rtde {
namespace {

constexpr std::array<std::string_view, 10> kTypeNames{
    "BOOL", "UINT8", "UINT32", "INT32", "UINT64", "DOUBLE", "VECTOR3D", "VECTOR6D", "VECTOR6INT32", "VECTOR6UINT32"};

}  // namespace

std::string_view type_name(DataType type) noexcept {
  return kTypeNames[static_cast<std::size_t>(type)];
}

std::optional<DataType> parse_type(std::string_view token) noexcept {
  for (std::size_t i = 0; i < kTypeNames.size(); ++i) {
    if (kTypeNames[i] == token) return static_cast<DataType>(i);
  }
  return std::nullopt;
}

std::string join_names(std::span<const Variable> recipe) {
  std::string names;
  for (const Variable& variable : recipe) {
    if (!names.empty()) names += ',';
    names += variable.name;
  }
  return names;
}

bool next_token(std::string_view& list, std::string_view& token) noexcept {
  if (list.empty()) return false;
  const std::size_t comma = list.find(',');
  token = list.substr(0, comma);
  list = comma == std::string_view::npos ? std::string_view{} : list.substr(comma + 1);
  return true;
}

}  // namespace embody::rtde
