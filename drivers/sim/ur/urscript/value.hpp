#pragma once
// A value of a running script. Fixed size, no heap; copies are deep, as assignment is in URScript.
#include <algorithm>
#include <array>
#include <cstdint>

namespace embody::sim::urscript {

enum class Type : std::uint8_t { kNone, kInt, kFloat, kBool, kString, kList, kPose };

/// For error messages.
[[nodiscard]] constexpr const char* type_name(Type type) noexcept {
  constexpr std::array<const char*, 7> kNames{"nothing", "int", "float", "bool", "string", "list", "pose"};
  return kNames[static_cast<std::size_t>(type)];
}

/// What fits into one number: int, float, bool (0 or 1), or a string by its index in Code::strings.
struct Scalar {
  Type type{Type::kNone};
  double number{0.0};
};

struct Value {
  static constexpr std::size_t kMaxItems = 64;

  Type type{Type::kNone};
  Type item_type{Type::kNone};  ///< of a list: kInt, kFloat or kBool; of a pose: kFloat
  std::uint8_t size{0};         ///< items of a list or pose
  double number{0.0};           ///< of a scalar
  std::array<double, kMaxItems> items;

  Value() noexcept {}  // NOLINT(modernize-use-equals-default): items beyond `size` have no value
  Value(const Value& other) noexcept { *this = other; }
  explicit Value(const Scalar& scalar) noexcept : type(scalar.type), number(scalar.number) {}
  Value& operator=(const Value& other) noexcept {
    if (this == &other) return *this;
    type = other.type;
    item_type = other.item_type;
    size = other.size;
    number = other.number;
    std::copy_n(other.items.begin(), size, items.begin());
    return *this;
  }
  ~Value() = default;

  [[nodiscard]] static Value integer(std::int32_t i) noexcept { return Value(Scalar{Type::kInt, double(i)}); }
  [[nodiscard]] static Value real(double f) noexcept { return Value(Scalar{Type::kFloat, f}); }
  [[nodiscard]] static Value boolean(bool b) noexcept { return Value(Scalar{Type::kBool, b ? 1.0 : 0.0}); }

  [[nodiscard]] bool is_number() const noexcept { return type == Type::kInt || type == Type::kFloat; }
  [[nodiscard]] bool has_items() const noexcept { return type == Type::kList || type == Type::kPose; }
};

}  // namespace embody::sim::urscript
