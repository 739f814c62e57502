#pragma once
// Text of bounded length that lives inside its owner: no heap, trivially copyable.
#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>

namespace embody {

/// At most `N` bytes of text; longer input is cut, never refused.
template <std::size_t N>
class FixedString {
 public:
  constexpr FixedString() = default;
  constexpr FixedString(std::string_view text) noexcept {  // NOLINT(google-explicit-constructor): text is text
    size_ = std::min(text.size(), N);
    std::copy_n(text.data(), size_, chars_.data());
  }
  constexpr FixedString(const char* text) noexcept : FixedString(std::string_view(text)) {}

  [[nodiscard]] constexpr std::string_view view() const noexcept { return {chars_.data(), size_}; }
  [[nodiscard]] constexpr const char* c_str() const noexcept { return chars_.data(); }
  [[nodiscard]] constexpr bool empty() const noexcept { return size_ == 0; }
  friend constexpr bool operator==(const FixedString& a, const FixedString& b) noexcept { return a.view() == b.view(); }

 private:
  std::array<char, N + 1> chars_{};  // always terminated
  std::size_t size_{0};
};

}  // namespace embody
