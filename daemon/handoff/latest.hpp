#pragma once
// One writer, one reader, newest value wins: a wait-free triple buffer. Nobody is woken, nothing is allocated.
#include <array>
#include <atomic>
#include <cstdint>

namespace embody {

/// The writer owns one slot, the reader one, the third lies in between and is swapped atomically.
/// A value that is overwritten before the reader looks is lost: that is the contract.
template <class T>
class Latest {
 public:
  /// Writer: publishes a copy of `value`.
  void publish(const T& value) noexcept {
    slots_[back_] = value;
    back_ = middle_.exchange(back_ | kNew, std::memory_order_acq_rel) & kIndex;
  }
  /// Reader: takes the newest value if there is one since the last call.
  bool update() noexcept {
    if ((middle_.load(std::memory_order_relaxed) & kNew) == 0) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    return true;
  }
  /// Reader: the value taken last (default-constructed before the first).
  [[nodiscard]] const T& get() const noexcept { return slots_[front_]; }

 private:
  static constexpr std::uint32_t kIndex = 3;
  static constexpr std::uint32_t kNew = 4;

  std::array<T, 3> slots_{};
  alignas(64) std::uint32_t back_{0};
  alignas(64) std::uint32_t front_{1};
  alignas(64) std::atomic<std::uint32_t> middle_{2};
};

}  // namespace embody
