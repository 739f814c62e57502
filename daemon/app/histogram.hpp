#pragma once
// Quantiles of durations in fixed memory.
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "core/base/time.hpp"

namespace embody {

/// Counts durations in buckets whose width is at most 1/32 of their value (values below 32 ns are exact); quantiles are
/// upper bucket edges, so they never flatter. Up to 2^40 ns.
class Histogram {
 public:
  void add(Duration d) noexcept {
    const auto ns = static_cast<std::uint64_t>(std::clamp<std::int64_t>(d.count(), 0, kLargest));
    ++buckets_[index(ns)];
    ++count_;
    max_ = std::max(max_, ns);
  }
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] double max_us() const noexcept { return static_cast<double>(max_) * 1e-3; }
  /// Smallest bucket edge that at least the part `quantile` (0..1) of all values does not exceed, in microseconds.
  [[nodiscard]] double quantile_us(double quantile) const noexcept {
    const auto wanted = static_cast<std::uint64_t>(quantile * static_cast<double>(count_) + 0.999999);
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < buckets_.size(); ++i) {
      seen += buckets_[i];
      if (seen >= wanted && seen > 0) return static_cast<double>(std::min(edge(i), max_)) * 1e-3;
    }
    return 0.0;
  }

 private:
  static constexpr int kBits = 5;  // sub-buckets per octave: 32
  static constexpr std::int64_t kLargest = (std::int64_t{1} << 40) - 1;

  static std::size_t index(std::uint64_t ns) noexcept {
    if (ns < (1U << kBits)) return ns;
    const int shift = static_cast<int>(std::bit_width(ns)) - kBits - 1;
    return (static_cast<std::size_t>(shift + 1) << kBits) + (ns >> shift) - (1U << kBits);
  }
  static std::uint64_t edge(std::size_t i) noexcept {
    if (i < (1U << kBits)) return i;
    const auto shift = (i >> kBits) - 1;
    return (((i & ((1U << kBits) - 1)) + (1U << kBits) + 1) << shift) - 1;
  }

  std::array<std::uint64_t, (40 - kBits + 1) << kBits> buckets_{};
  std::uint64_t count_{0};
  std::uint64_t max_{0};
};

}  // namespace embody
