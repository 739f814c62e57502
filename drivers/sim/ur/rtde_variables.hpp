#pragma once
// The variables that the simulated controller offers over RTDE, and their present values as wire bytes. A value
// survives the client that wrote it, like on the real controller.
#include <map>
#include <vector>

#include "core/math/pose.hpp"
#include "drivers/ur_rtde/wire.hpp"

namespace embody::sim {

enum class Access : std::uint8_t {
  kOutput,    ///< clients subscribe
  kInput,     ///< clients write
  kRegister,  ///< clients write, and may subscribe as well
};

class RtdeVariables {
 public:
  using Index = std::size_t;

  RtdeVariables();

  [[nodiscard]] std::optional<Index> find(std::string_view name) const;
  /// @pre the variable exists; for names that the program itself uses.
  [[nodiscard]] Index at(std::string_view name) const { return *find(name); }
  [[nodiscard]] std::size_t count() const noexcept { return entries_.size(); }
  [[nodiscard]] rtde::DataType type(Index index) const noexcept { return entries_[index].type; }
  [[nodiscard]] bool readable(Index index) const noexcept { return entries_[index].access != Access::kInput; }
  [[nodiscard]] bool writable(Index index) const noexcept { return entries_[index].access != Access::kOutput; }

  /// Present value in wire order.
  [[nodiscard]] std::span<std::byte> bytes(Index index) noexcept {
    return std::span(values_).subspan(entries_[index].offset, rtde::wire_size(entries_[index].type));
  }
  /// @pre T is the C++ type of the variable.
  template <class T>
  void set(Index index, T value) noexcept {
    rtde::store(bytes(index), 0, value);
  }
  template <class T>
  [[nodiscard]] T get(Index index) noexcept {
    return rtde::load<T>(bytes(index), 0);
  }
  void set_vector(Index index, const math::Vector6& value) noexcept;

 private:
  struct Entry {
    rtde::DataType type{rtde::DataType::kDouble};
    Access access{Access::kOutput};
    std::size_t offset{0};
  };
  void add(const std::string& name, rtde::DataType type, Access access);
  void add_outputs();
  void add_registers();
  void add_inputs();

  std::map<std::string, Index, std::less<>> names_;
  std::vector<Entry> entries_;
  std::vector<std::byte> values_;
};

}  // namespace embody::sim
