#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "core/base/fixed_string.hpp"
#include "core/base/result.hpp"
#include "core/base/static_vector.hpp"
#include "core/base/time.hpp"

namespace embody {
namespace {

TEST(FixedString, KeepsWhatFitsAndCutsTheRest) {
  for (std::size_t length = 0; length < 20; ++length) {
    const std::string text(length, 'x');
    const FixedString<8> kept{std::string_view(text)};
    EXPECT_EQ(kept.view(), text.substr(0, 8));
    EXPECT_EQ(std::string(kept.c_str()), text.substr(0, 8)) << "not terminated";
    EXPECT_EQ(kept.empty(), length == 0);
  }
}

TEST(FixedString, ComparesByItsTextAlone) {
  FixedString<8> reused{"longer"};
  reused = FixedString<8>{"ab"};
  EXPECT_EQ(reused, FixedString<8>{"ab"});
  EXPECT_FALSE(reused == FixedString<8>{"abc"});
}

TEST(StaticVector, NeverHoldsMoreThanItsCapacity) {
  StaticVector<int, 3> values;
  EXPECT_TRUE(values.push_back(1) && values.push_back(2) && values.push_back(3));
  EXPECT_FALSE(values.push_back(4));
  EXPECT_EQ(values.size(), 3U);
  EXPECT_EQ(values[2], 3);
  values.resize(1000);
  EXPECT_EQ(values.size(), 3U);
  values.resize(1);
  EXPECT_EQ(values.end() - values.begin(), 1);
  values.clear();
  EXPECT_TRUE(values.empty());
}

TEST(Result, IsAValueOrAnErrorAndNeverBoth) {
  const Result<int> good = 7;
  ASSERT_TRUE(good.ok());
  EXPECT_EQ(*good, 7);
  const Result<int> bad = make_error(Errc::kTimeout, "no reply from %s within %d ms", "robot", 20);
  ASSERT_FALSE(bad.ok());
  EXPECT_EQ(bad.error().code, Errc::kTimeout);
  EXPECT_EQ(bad.error().detail.view(), "no reply from robot within 20 ms");
  EXPECT_TRUE(Status{}.ok());
  EXPECT_FALSE(Status(bad.error()).ok());
}

TEST(Result, CarriesValuesThatCanOnlyBeMoved) {
  Result<std::unique_ptr<int>> result = std::make_unique<int>(3);
  const std::unique_ptr<int> value = std::move(result).value();
  ASSERT_NE(value, nullptr);
  EXPECT_EQ(*value, 3);
}

TEST(MakeError, CutsLongTextAndKeepsPercentSignsOfArguments) {
  const std::string text(1000, 'y');
  const Error error = make_error(Errc::kMalformed, "%s", text.c_str());
  EXPECT_EQ(error.detail.view(), text.substr(0, 240));
  EXPECT_EQ(make_error(Errc::kMalformed, "%s", "%n%s").detail.view(), "%n%s");
}

TEST(Time, SecondsAndDurationsAgree) {
  EXPECT_EQ(from_seconds(0.002), std::chrono::milliseconds(2));
  EXPECT_DOUBLE_EQ(to_seconds(std::chrono::microseconds(1500)), 0.0015);
  EXPECT_EQ(TimePoint{}.time_since_epoch(), Duration{0});
}

}  // namespace
}  // namespace embody
