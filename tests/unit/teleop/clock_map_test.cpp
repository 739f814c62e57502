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

}  // namespace
}  // namespace embody::teleop
