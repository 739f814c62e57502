#pragma once
// A vector of bounded capacity that lives inside its owner: no heap, no exceptions.
#include <array>
#include <cstddef>

namespace embody {

/// Up to `N` values of a default-constructible T, contiguous.
template <class T, std::size_t N>
class StaticVector {
 public:
  /// Appends `value`; returns false (and changes nothing) when full.
  constexpr bool push_back(const T& value) noexcept {
    if (size_ == N) return false;
    items_[size_++] = value;
    return true;
  }
  constexpr void clear() noexcept { size_ = 0; }
  /// Sets the size; `size` beyond the capacity is cut. Kept items stay, new ones are what the slot held before.
  constexpr void resize(std::size_t size) noexcept { size_ = size < N ? size : N; }

  [[nodiscard]] constexpr std::size_t size() const noexcept { return size_; }
  [[nodiscard]] constexpr bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] static constexpr std::size_t capacity() noexcept { return N; }
  constexpr T& operator[](std::size_t i) noexcept { return items_[i]; }
  constexpr const T& operator[](std::size_t i) const noexcept { return items_[i]; }
  constexpr T* begin() noexcept { return items_.data(); }
  constexpr T* end() noexcept { return items_.data() + size_; }
  constexpr const T* begin() const noexcept { return items_.data(); }
  constexpr const T* end() const noexcept { return items_.data() + size_; }

 private:
  std::array<T, N> items_{};
  std::size_t size_{0};
};

}  // namespace embody
