#include "daemon/app/histogram.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/unit/math/random_values.hpp"

namespace embody {
namespace {

TEST(Histogram, NeverFlattersAndIsAtMostOneThirtySecondAbove) {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6}) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    test::RandomValues random(seed);
    Histogram histogram;
    std::vector<std::int64_t> values;
    const double largest_bits = random(3.0, 39.9);
    for (int i = 0; i < 20'000; ++i) {
      values.push_back(static_cast<std::int64_t>(std::exp2(random(0.0, largest_bits))) - 1);
      histogram.add(Duration{values.back()});
    }
    std::sort(values.begin(), values.end());
    EXPECT_EQ(histogram.count(), values.size());
    EXPECT_DOUBLE_EQ(histogram.max_us(), static_cast<double>(values.back()) * 1e-3);
    for (const double quantile : {0.0, 0.001, 0.01, 0.25, 0.5, 0.9, 0.99, 0.999, 0.9999, 1.0}) {
      const auto rank = static_cast<std::size_t>(std::ceil(quantile * static_cast<double>(values.size()) - 1e-9));
      const double truth_us = static_cast<double>(values[rank > 0 ? rank - 1 : 0]) * 1e-3;
      const double told_us = histogram.quantile_us(quantile);
      EXPECT_GE(told_us, truth_us * (1.0 - 1e-12)) << "quantile " << quantile;
      EXPECT_LE(told_us, truth_us * (1.0 + 1.0 / 32.0) + 1e-9) << "quantile " << quantile;
    }
  }
}

TEST(Histogram, IsExactBelowThirtyTwoNanosecondsAndForASingleValue) {
  for (int ns = 0; ns < 32; ++ns) {
    Histogram histogram;
    histogram.add(Duration{ns});
    histogram.add(Duration{1'000'000});
    EXPECT_DOUBLE_EQ(histogram.quantile_us(0.5), ns * 1e-3);
  }
  Histogram single;
  single.add(Duration{123'456'789});
  for (const double quantile : {0.0, 0.5, 1.0}) EXPECT_DOUBLE_EQ(single.quantile_us(quantile), 123'456.789);
}

TEST(Histogram, TakesAnyDuration) {
  Histogram histogram;
  EXPECT_EQ(histogram.quantile_us(0.5), 0.0) << "nothing measured yet";
  for (const Duration d : {Duration::min(), Duration{-1}, Duration{0}, Duration::max()}) histogram.add(d);
  EXPECT_EQ(histogram.count(), 4U);
  EXPECT_EQ(histogram.quantile_us(0.75), 0.0);
  EXPECT_GE(histogram.quantile_us(1.0), 1e9) << "beyond the range it counts as the largest value";
}

TEST(Histogram, QuantilesRiseWithTheirPart) {
  test::RandomValues random(9);
  Histogram histogram;
  for (int i = 0; i < 1000; ++i) histogram.add(from_seconds(random(0.0, 0.01)));
  double last = 0.0;
  for (double quantile = 0.0; quantile <= 1.0; quantile += 0.001) {
    ASSERT_GE(histogram.quantile_us(quantile), last);
    last = histogram.quantile_us(quantile);
  }
}

}  // namespace
}  // namespace embody
