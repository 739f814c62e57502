#include "core/hand/hand_state_filter.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "tests/support/heap_counter.hpp"

namespace embody::hand {
namespace {

using std::chrono::milliseconds;
using Angles = Eigen::Matrix<double, static_cast<int>(kHandAngles), 1>;

constexpr std::array<double, 3> kRates_hz{50.0, 100.0, 240.0};
constexpr auto kIndex = static_cast<std::size_t>(Finger::kIndex);
constexpr auto kThumb = static_cast<std::size_t>(Finger::kThumb);
constexpr TimePoint kStart{std::chrono::seconds(5)};

HandStateFilterConfig lags(Duration at_rest, Duration in_motion) {
  HandStateFilterConfig config;
  config.lag_at_rest = at_rest;
  config.lag_in_motion = in_motion;
  return config;
}

/// A valid state `t_s` after the start, all angles equal to `q_rad`, p_M left wrong on purpose.
HandState state_at(double t_s, const Angles& q_rad) {
  HandState state;
  state.valid = true;
  state.t_capture = kStart + from_seconds(t_s);
  state.q_rad = q_rad;
  return state;
}

/// Index middle joint flexes with constant speed; its axis stays.
Angles ramp(double t_s, double speed_rad_s) {
  Angles q = Angles::Zero();
  q(5) = -0.5 + speed_rad_s * t_s;
  return q;
}

/// Delay of the output behind the ramp after `seconds`, s.
double delay_s(HandStateFilter& filter, double rate_hz, double speed_rad_s, double seconds) {
  double late_s = 0.0;
  for (int k = 0; k < static_cast<int>(seconds * rate_hz); ++k) {
    const double t_s = to_seconds(from_seconds(k / rate_hz));
    HandState state = state_at(t_s, ramp(t_s, speed_rad_s));
    filter.step(state);
    late_s = t_s - (state.q_rad(5) + 0.5) / speed_rad_s;
  }
  return late_s;
}

TEST(HandStateFilter, FollowsAConstantSpeedExactlyTheSetLagLateAtAnyFrameRate) {
  for (const double rate_hz : kRates_hz) {
    for (const int lag_ms : {5, 40, 150}) {
      HandStateFilter filter(HandModel{}, lags(milliseconds(lag_ms), milliseconds(lag_ms)));
      EXPECT_NEAR(delay_s(filter, rate_hz, 0.3, 4.0), 1e-3 * lag_ms, 1e-6) << rate_hz << " Hz";
      EXPECT_NEAR(to_seconds(filter.lag()[kIndex]), 1e-3 * lag_ms, 1e-6);
    }
  }
}

TEST(HandStateFilter, KeepsItsLagWhenFramesComeUnevenly) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> step_s(0.002, 0.08);
  HandStateFilter filter(HandModel{}, lags(milliseconds(60), milliseconds(60)));
  double t_s = 0.0;
  for (int k = 0; k < 500; ++k) {
    t_s = to_seconds(from_seconds(t_s + step_s(random)));
    HandState state = state_at(t_s, ramp(t_s, 0.05));
    filter.step(state);
    if (k > 100) {
      ASSERT_NEAR(t_s - (state.q_rad(5) + 0.5) / 0.05, 0.060, 1e-6) << "step " << k;
    }
  }
}

TEST(HandStateFilter, HasTheLagOfRestWhenSlowAndTheLagOfMotionWhenFastAtAnyFrameRate) {
  for (const double rate_hz : kRates_hz) {
    HandStateFilter slow(HandModel{}, lags(milliseconds(100), milliseconds(20)));
    EXPECT_NEAR(delay_s(slow, rate_hz, 0.19, 4.0), 0.100, 1e-6) << rate_hz << " Hz";
    HandStateFilter fast(HandModel{}, lags(milliseconds(100), milliseconds(20)));
    EXPECT_NEAR(delay_s(fast, rate_hz, 0.61, 4.0), 0.020, 1e-6) << rate_hz << " Hz";
  }
}

TEST(HandStateFilter, FallsFromTheLagOfRestToThatOfMotionAsTheSpeedGrows) {
  double last_s = 0.1;
  for (double speed_rad_s = 0.05; speed_rad_s < 1.0; speed_rad_s += 0.05) {
    HandStateFilter filter(HandModel{}, lags(milliseconds(100), milliseconds(20)));
    const double late_s = delay_s(filter, 100.0, speed_rad_s, 4.0);
    EXPECT_GE(late_s, 0.020 - 1e-6);
    EXPECT_LE(late_s, last_s + 1e-6) << speed_rad_s << " rad/s";
    EXPECT_NEAR(late_s, to_seconds(filter.lag()[kIndex]), 1e-6) << "the stated lag is the real one";
    last_s = late_s;
  }
}

TEST(HandStateFilter, AdaptsEachFingerOnItsOwn) {
  HandStateFilter filter(HandModel{}, lags(milliseconds(100), milliseconds(20)));
  (void)delay_s(filter, 100.0, 1.0, 2.0);
  EXPECT_NEAR(to_seconds(filter.lag()[kIndex]), 0.020, 1e-9);
  EXPECT_NEAR(to_seconds(filter.lag()[kThumb]), 0.100, 1e-9);
}

TEST(HandStateFilter, AnswersAStepMonotonouslyWithoutOvershoot) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> angle(-1.5, 1.5);
  for (const double rate_hz : kRates_hz) {
    HandStateFilter filter(HandModel{}, lags(milliseconds(150), milliseconds(10)));
    Angles from, to;
    for (Eigen::Index i = 0; i < from.size(); ++i) from(i) = angle(random), to(i) = angle(random);
    Angles last = from;
    for (int k = 0; k < static_cast<int>(5 * rate_hz); ++k) {
      HandState state = state_at(k / rate_hz, k < 10 ? from : to);
      filter.step(state);
      const Angles forward = (state.q_rad - last).cwiseProduct((to - from).cwiseSign());
      ASSERT_GE(forward.minCoeff(), -1e-12) << rate_hz << " Hz, step " << k;
      ASSERT_GE((to - state.q_rad).cwiseProduct((to - from).cwiseSign()).minCoeff(), -1e-12) << "overshoot at " << k;
      last = state.q_rad;
    }
    EXPECT_LT((last - to).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(HandStateFilter, PredictionRemovesAKnownDelayOfAConstantSpeed) {
  for (const double rate_hz : kRates_hz) {
    HandStateFilterConfig config = lags(milliseconds(30), milliseconds(30));
    config.predict = milliseconds(80);  // the filter's 30 ms and 50 ms on the way to the robot
    HandStateFilter filter(HandModel{}, config);
    EXPECT_NEAR(delay_s(filter, rate_hz, 1.0, 4.0), -0.050, 1e-6) << rate_hz << " Hz";
    EXPECT_NEAR(to_seconds(filter.lag()[kIndex]), -0.050, 1e-6);
  }
}

TEST(HandStateFilter, PredictionChangesNoAngleByMoreThanItsLimit) {
  std::mt19937 random(5);
  std::normal_distribution<double> step(0.0, 0.2);
  HandStateFilterConfig config = lags(milliseconds(60), milliseconds(10));
  HandStateFilter plain(HandModel{}, config);
  config.predict = milliseconds(150);
  config.predict_limit_rad = 0.07;
  HandStateFilter filter(HandModel{}, config);
  Angles q = Angles::Zero();
  double largest = 0.0;
  for (int k = 0; k < 2000; ++k) {
    for (Eigen::Index i = 0; i < q.size(); ++i) q(i) = std::clamp(q(i) + step(random), -1.5, 1.5);
    HandState expected = state_at(0.01 * k, q);
    HandState state = expected;
    plain.step(expected);
    filter.step(state);
    for (Eigen::Index i = 0; i < q.size(); i += 3) {
      const double change = (state.q_rad - expected.q_rad).segment<3>(i).norm();
      ASSERT_LE(change, 0.07 + 1e-12) << "step " << k;
      largest = std::max(largest, change);
    }
  }
  EXPECT_NEAR(largest, 0.07, 1e-9) << "the limit was put to the test";
}

TEST(HandStateFilter, PredictsNothingForAHandThatIsStillOrTrembles) {
  std::mt19937 random(9);
  std::normal_distribution<double> noise(0.0, 0.01);
  HandStateFilterConfig config = lags(milliseconds(100), milliseconds(20));
  HandStateFilter plain(HandModel{}, config);
  config.predict = milliseconds(100);
  HandStateFilter filter(HandModel{}, config);
  for (int k = 0; k < 1000; ++k) {
    Angles q = ramp(0.0, 0.0);
    if (k > 500) {
      for (Eigen::Index i = 0; i < q.size(); ++i) q(i) += noise(random);
    }
    HandState expected = state_at(0.01 * k, q);
    HandState state = expected;
    plain.step(expected);
    filter.step(state);
    ASSERT_EQ(state.q_rad, expected.q_rad) << "step " << k;
    if (k < 500) {
      ASSERT_LT((state.q_rad - q).cwiseAbs().maxCoeff(), 1e-12);
    }
  }
}

TEST(HandStateFilter, PutsTheModelPointsWhereTheFilteredAnglesPutThem) {
  const HandModel model;
  HandStateFilter filter(model, lags(milliseconds(100), milliseconds(100)));
  for (int k = 0; k < 50; ++k) {
    HandState state = state_at(0.01 * k, ramp(0.01 * k, 1.0));
    filter.step(state);
    if (k == 0) continue;  // a restart passes the state as it came
    for (std::size_t f = 0; f < kFingers; ++f) {
      const Vector9 q = state.q_rad.segment<9>(static_cast<Eigen::Index>(kFingerOffset[f]));
      const auto points = model.finger_points(static_cast<Finger>(f), q);
      ASSERT_EQ(state.p_M[f][0], points[0]);
      ASSERT_EQ(state.p_M[f][1], points[1]);
    }
  }
}

TEST(HandStateFilter, PassesEverythingBitByBitWhenItIsOff) {
  HandStateFilter filter(HandModel{}, {});
  for (int k = 0; k < 20; ++k) {
    HandState state = state_at(0.01 * k, Angles::Constant(0.1 * k));
    state.p_M[2][1] = Eigen::Vector3d(1.0, 2.0, 3.0);
    filter.step(state);
    EXPECT_EQ(state.q_rad, Angles::Constant(0.1 * k).eval());
    EXPECT_EQ(state.p_M[2][1], Eigen::Vector3d(1.0, 2.0, 3.0));
  }
}

/// A filter that has followed a ramp for a second; the next frame is due at 1 s.
HandStateFilter running_filter() {
  HandStateFilter filter(HandModel{}, lags(milliseconds(100), milliseconds(100)));
  (void)delay_s(filter, 100.0, 0.5, 1.0);
  return filter;
}

TEST(HandStateFilter, PassesAnInvalidStateAndStartsAfreshBehindIt) {
  for (const bool not_finite : {false, true}) {
    HandStateFilter filter = running_filter();
    HandState state = state_at(1.0, Angles::Constant(0.7));
    state.valid = not_finite;
    if (not_finite) state.q_rad(7) = std::numeric_limits<double>::quiet_NaN();
    const HandState given = state;
    filter.step(state);
    EXPECT_EQ(state.q_rad(3), given.q_rad(3));
    state = state_at(1.01, Angles::Constant(0.8));
    filter.step(state);
    EXPECT_EQ(state.q_rad, Angles::Constant(0.8).eval());
    state = state_at(1.02, Angles::Constant(0.9));
    filter.step(state);
    EXPECT_TRUE(state.q_rad.allFinite());
    EXPECT_LT(state.q_rad.maxCoeff(), 0.82) << "filtered again";
  }
}

TEST(HandStateFilter, StartsAfreshAfterALongGapOrAClockThatWentBack) {
  for (const double t_s : {0.99 + 0.201, 0.99 - 0.201}) {
    HandStateFilter filter = running_filter();
    HandState state = state_at(t_s, Angles::Constant(0.7));
    filter.step(state);
    EXPECT_EQ(state.q_rad, Angles::Constant(0.7).eval());
  }
  HandStateFilter filter = running_filter();
  HandState state = state_at(0.99 + 0.199, Angles::Constant(0.7));
  filter.step(state);
  EXPECT_NE(state.q_rad, Angles::Constant(0.7).eval()) << "a short gap is bridged";
}

TEST(HandStateFilter, GivesTheLastAnglesToAStateThatIsNotNewer) {
  HandStateFilter filter = running_filter();
  HandState last = state_at(1.0, ramp(1.0, 0.5));
  filter.step(last);
  for (const double t_s : {1.0, 0.95}) {
    HandState state = state_at(t_s, Angles::Constant(0.7));
    filter.step(state);
    EXPECT_EQ(state.q_rad, last.q_rad);
    EXPECT_EQ(state.p_M[kIndex][0], last.p_M[kIndex][0]);
  }
}

TEST(HandStateFilter, UsesNoHeap) {
  HandStateFilterConfig config = lags(milliseconds(100), milliseconds(20));
  config.predict = milliseconds(50);
  HandStateFilter filter(HandModel{}, config);
  const std::uint64_t before = test::heap_allocations();
  for (int k = 0; k < 100; ++k) {
    HandState state = state_at(0.01 * k, ramp(0.01 * k, 1.0));
    state.valid = k % 30 != 29;
    filter.step(state);
  }
  EXPECT_EQ(test::heap_allocations() - before, 0U);
  static_assert(noexcept(filter.step(std::declval<HandState&>())));
}

}  // namespace
}  // namespace embody::hand
