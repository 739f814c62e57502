#include "core/teleop/clock_map.hpp"

#include <gtest/gtest.h>

#include "tests/unit/math/random_values.hpp"

namespace embody::teleop {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

/// A device clock that runs `rate` times as fast as ours, and messages that take 1 ms or more.
struct Device {
  double rate{1.0};
  Duration time{seconds(7)};
  TimePoint sent{seconds(5000)};

  TimePoint advance(Duration ours, Duration late = Duration{0}) {
    sent += ours;
    time += Duration{static_cast<Duration::rep>(rate * static_cast<double>(ours.count()))};
    return sent + milliseconds(1) + late;
  }
};

TEST(ClockMap, KeepsTheSpacingOfTheDeviceWhateverTheDelays) {
  test::RandomValues random(1);
  ClockMap map;
  Device device;
  TimePoint arrival = device.advance(milliseconds(2));
  TimePoint last = map.map(device.time, arrival);
  for (int i = 0; i < 50'000; ++i) {
    arrival = device.advance(milliseconds(2),
                             random(0.0, 1.0) < 0.2 ? Duration(from_seconds(random(0.0, 0.030))) : Duration{0});
    const TimePoint mapped = map.map(device.time, arrival);
    ASSERT_LE(mapped, arrival) << "from the future";
    ASSERT_LT(std::chrono::abs(mapped - last - milliseconds(2)), microseconds(20)) << "message " << i;
    last = mapped;
  }
}

TEST(ClockMap, FollowsADeviceClockThatDrifts) {
  for (const double rate : {1.0 - 5e-5, 1.0, 1.0 + 5e-5}) {
    ClockMap map;
    Device device;
    device.rate = rate;
    TimePoint mapped{};
    for (int i = 0; i < 3600 * 100; ++i) {  // an hour: 180 ms of drift
      const TimePoint arrival = device.advance(milliseconds(10));
      mapped = map.map(device.time, arrival);
      ASSERT_LE(mapped, arrival);
      ASSERT_LT(arrival - mapped, microseconds(10)) << "rate " << rate << ", message " << i;
    }
  }
}

TEST(ClockMap, IsCorrectedByTheFirstFastMessage) {
  ClockMap map;
  Device device;
  TimePoint arrival = device.advance(milliseconds(2), milliseconds(40));  // the connection begins with a backlog
  EXPECT_EQ(map.map(device.time, arrival), arrival);
  arrival = device.advance(milliseconds(2));
  EXPECT_EQ(map.map(device.time, arrival), arrival);
}

TEST(ClockMap, StartsAfreshWhenTheDeviceClockJumps) {
  for (const Duration jump : {Duration(seconds(-5)), Duration(seconds(2)), Duration(-milliseconds(1))}) {
    ClockMap map;
    Device device;
    for (int i = 0; i < 100; ++i) {
      const TimePoint arrival = device.advance(milliseconds(2));
      map.map(device.time, arrival);
    }
    device.time += jump;
    const TimePoint arrival = device.advance(Duration{0}, milliseconds(3));
    EXPECT_EQ(map.map(device.time, arrival), arrival);
  }
}

/// Messages every 2 ms whose delay beyond the least one is usually `jitter` and rarely nothing.
struct Traffic {
  double drift{0.0};
  double fast_share{0.2};  ///< of messages that take no longer than the least
  double jitter_s{0.001};
};

TEST(ClockMap, ErrsNoMoreThanTheFastestMessagesWhateverTheDrift) {
  struct Case {
    Traffic traffic;
    Duration bound;
  };
  for (const auto& [traffic, bound] :
       {Case{{0.0, 0.2, 0.001}, microseconds(20)}, Case{{2e-4, 0.2, 0.001}, microseconds(20)},
        Case{{-2e-4, 0.2, 0.001}, microseconds(20)}, Case{{2e-4, 0.002, 0.005}, microseconds(250)},
        Case{{-2e-4, 0.002, 0.005}, microseconds(250)}, Case{{5e-5, 0.002, 0.005}, microseconds(250)}}) {
    test::RandomValues random(/*seed=*/12);
    ClockMap map;
    Device device;
    device.rate = 1.0 + traffic.drift;
    TimePoint last{}, t_arrival{};
    Duration worst_late{0}, worst_early{0};
    for (int i = 0; i < 5 * 60 * 500; ++i) {
      const bool fast = random(0.0, 1.0) < traffic.fast_share;
      const double delay_s = fast ? 0.0 : traffic.jitter_s * random(0.02, 1.0);
      t_arrival = std::max(t_arrival, device.advance(milliseconds(2), from_seconds(delay_s)));
      const TimePoint mapped = map.map(device.time, t_arrival);
      ASSERT_LE(mapped, t_arrival) << "from the future";
      ASSERT_GE(mapped, last) << "went back at message " << i;
      last = mapped;
      if (i < 60 * 500) continue;
      const Duration error = mapped - (device.sent + milliseconds(1));
      worst_late = std::max(worst_late, error);
      worst_early = std::max(worst_early, -error);
    }
    EXPECT_LT(worst_late, bound) << "drift " << traffic.drift << ", fast " << traffic.fast_share;
    EXPECT_LT(worst_early, bound) << "drift " << traffic.drift << ", fast " << traffic.fast_share;
    EXPECT_NEAR(map.drift(), -traffic.drift, 2e-5) << "drift " << traffic.drift << ", fast " << traffic.fast_share;
  }
}

TEST(ClockMap, RecoversAfterEachReset) {
  test::RandomValues random(/*seed=*/13);
  ClockMap map;
  Device device;
  device.rate = 1.0 + 1e-4;
  TimePoint last{};
  for (int reset = 0; reset < 50; ++reset) {
    device.time = from_seconds(random(0.0, 1000.0));
    for (int i = 0; i < 1000; ++i) {
      const bool first = i == 0;
      const TimePoint arrival =
          device.advance(milliseconds(2), first || i % 5 != 0 ? Duration{microseconds(300)} : Duration{0});
      const TimePoint mapped = map.map(device.time, arrival);
      ASSERT_LE(mapped, arrival);
      ASSERT_GE(mapped, last);
      last = mapped;
      if (i < 10) continue;
      ASSERT_LT(std::chrono::abs(mapped - (device.sent + milliseconds(1))), microseconds(20)) << i;
    }
  }
}

TEST(ClockMap, NeverGoesBackThoughABacklogCorrectsTheOffset) {
  ClockMap map;
  Device device;
  TimePoint last{};
  for (int i = 0; i < 100; ++i) {  // 200 ms of messages that were waiting and are read at once
    (void)device.advance(milliseconds(2));
    const TimePoint mapped = map.map(device.time, TimePoint(seconds(5001)));
    ASSERT_GE(mapped, last);
    ASSERT_LE(mapped, TimePoint(seconds(5001)));
    last = mapped;
  }
}

}  // namespace
}  // namespace embody::teleop
