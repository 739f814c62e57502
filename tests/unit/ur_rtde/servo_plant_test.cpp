#include "drivers/sim/ur/servo_plant.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace embody::sim {
namespace {

constexpr Duration kCycle = std::chrono::milliseconds(2);
constexpr double kCycle_s = 0.002;
constexpr Duration kLag = std::chrono::milliseconds(50);

TEST(ServoPlant, LagsARampByTheGivenTime) {
  for (const double lag_s : {0.034, 0.05, 0.11, 0.2}) {
    ServoPlant plant({}, Vector6::Zero());
    double set = 0.0;
    for (int i = 0; i < 1000; ++i)
      plant.follow(Vector6::Constant(set = 0.5 * i * kCycle_s), from_seconds(lag_s), kCycle);
    EXPECT_NEAR((set - plant.q_rad()[0]) / 0.5, lag_s, 0.003);
    EXPECT_NEAR(plant.qd_rad_s()[0], 0.5, 1e-3);
  }
}

TEST(ServoPlant, LookAheadAndGainGiveTheLagsThatUsersReport) {
  EXPECT_NEAR(to_seconds(servo_lag(0.03, 1200.0)), 0.034, 0.003);
  EXPECT_NEAR(to_seconds(servo_lag(0.1, 300.0)), 0.1, 0.015);
  EXPECT_GT(servo_lag(0.1, 600.0), servo_lag(0.05, 600.0));
  EXPECT_GT(servo_lag(0.1, 300.0), servo_lag(0.1, 600.0));
}

TEST(ServoPlant, ReachesAStepWithoutOvershoot) {
  ServoPlant plant({}, Vector6::Zero());
  for (int i = 0; i < 500; ++i) {
    plant.follow(Vector6::Constant(0.01), kLag, kCycle);
    ASSERT_LE(plant.q_rad().maxCoeff(), 0.01 + 1e-12);
  }
  EXPECT_NEAR(plant.q_rad()[3], 0.01, 1e-6);
}

TEST(ServoPlant, NeverExceedsTheSpeedOfItsMotors) {
  const ServoPlantConfig config;
  ServoPlant plant(config, Vector6::Zero());
  Vector6 before = plant.q_rad();
  for (int i = 0; i < 500; ++i) {
    plant.follow(Vector6::Constant(i % 100 < 50 ? 3.0 : -3.0), kLag, kCycle);
    for (int k = 0; k < 6; ++k) {
      ASSERT_LE(std::abs(plant.q_rad()[k] - before[k]), config.max_speed_rad_s[k] * kCycle_s + 1e-12);
    }
    before = plant.q_rad();
  }
}

TEST(ServoPlant, DeceleratesEvenlyToRest) {
  ServoPlant plant({}, Vector6::Zero());
  double set = 0.0;
  for (int i = 0; i < 1000; ++i) plant.follow(Vector6::Constant(set = 0.5 * i * kCycle_s), kLag, kCycle);
  const double from = plant.q_rad()[0];
  const double speed = plant.qd_rad_s()[0];
  for (int i = 0; i < 200; ++i) plant.decelerate(4.0, kCycle);
  EXPECT_EQ(plant.qd_rad_s()[0], 0.0);
  EXPECT_NEAR(plant.q_rad()[0] - from, speed * speed / 8.0, 1e-3);
}

}  // namespace
}  // namespace embody::sim
