#pragma once
// Numbers that a driver counts on its way and everybody may look at.
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>

namespace embody {

/// A count since the driver was made. Any thread may count and any may read: relaxed, so that two counters need not fit
/// each other. Copies are snapshots.
class Counter {
 public:
  constexpr Counter(std::uint64_t value = 0) noexcept : value_(value) {}  // NOLINT(google-explicit-constructor)
  Counter(const Counter& other) noexcept : value_(other.get()) {}
  Counter& operator=(const Counter& other) noexcept {
    value_.store(other.get(), std::memory_order_relaxed);
    return *this;
  }

  Counter& operator++() noexcept { return *this += 1; }
  Counter& operator+=(std::uint64_t by) noexcept {
    value_.fetch_add(by, std::memory_order_relaxed);
    return *this;
  }
  [[nodiscard]] std::uint64_t get() const noexcept { return value_.load(std::memory_order_relaxed); }
  operator std::uint64_t() const noexcept { return get(); }  // NOLINT(google-explicit-constructor): it is a number

 private:
  std::atomic<std::uint64_t> value_;
};

/// A counter under the name that people see (docs/control.md). Both live as long as the driver.
struct NamedCounter {
  const char* name{nullptr};
  const Counter* value{nullptr};
};

/// The counters that a driver shows: fixed once its constructor is through, so that any thread may walk them.
class CounterTable {
 public:
  static constexpr std::size_t kCapacity = 12;  ///< what a person still reads; the rest is left out

  CounterTable() = default;
  CounterTable(std::initializer_list<NamedCounter> counters) noexcept {
    for (const NamedCounter& counter : counters) {
      if (size_ < kCapacity) counters_[size_++] = counter;
    }
  }
  [[nodiscard]] std::span<const NamedCounter> view() const noexcept { return {counters_.data(), size_}; }

 private:
  std::array<NamedCounter, kCapacity> counters_{};
  std::size_t size_{0};
};

}  // namespace embody
