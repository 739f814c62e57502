#pragma once
// One writer, one reader, bounded, in order: for what must not be overwritten. A full ring drops the new value and
// counts it.
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace embody {

template <class T, std::size_t N>
class EventRing {
  static_assert((N & (N - 1)) == 0, "the capacity is a power of two");

 public:
  /// Writer. False when the ring is full; the value is then dropped and counted.
  bool push(const T& value) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) == N) {
      dropped_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    items_[head & (N - 1)] = value;
    head_.store(head + 1, std::memory_order_release);
    return true;
  }
  /// Reader. False when the ring is empty.
  bool pop(T& value) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == head_.load(std::memory_order_acquire)) return false;
    value = items_[tail & (N - 1)];
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  std::array<T, N> items_{};
  alignas(64) std::atomic<std::size_t> head_{0};
  alignas(64) std::atomic<std::size_t> tail_{0};
  std::atomic<std::uint64_t> dropped_{0};
};

}  // namespace embody
