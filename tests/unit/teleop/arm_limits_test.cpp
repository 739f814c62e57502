// Workspace, reach, speed and joint limits of the arm controller.
#include <gtest/gtest.h>

#include <cstdio>

#include "core/teleop/arm_controller.hpp"
#include "tests/unit/math/random_values.hpp"
#include "tests/unit/teleop/arm_rig.hpp"

namespace embody::teleop {
namespace {

using test::angle;
using test::ArmRig;
using test::cell_config;
using test::distance;
using test::LimitCheck;
using test::resting_at;
using test::usual_posture;
using test::waving_around;
constexpr double kTick_s = ArmRig::kTick_s;

TEST(ArmController, KeepsTheFlangeInsideTheWorkspaceUpToItsBrakingDistance) {
  ArmControllerConfig config = cell_config(Clutch::kAbsolute);
  const Pose X_BE = robot::forward_kinematics(usual_posture());
  config.workspace_B.min_m = X_BE.translation().array() - 0.05;
  config.workspace_B.max_m = X_BE.translation().array() + 0.05;
  ArmRig rig(config, waving_around(X_BE, 0.25, 0.3, 2.0));
  ASSERT_TRUE(rig.measure(usual_posture()));
  rig.engage();
  LimitCheck check(config.joints, usual_posture());
  double outside_m = 0.0;
  double target_outside_m = 0.0;
  const auto excess = [&](const Eigen::Vector3d& p) {
    return std::max((p - config.workspace_B.max_m).maxCoeff(), (config.workspace_B.min_m - p).maxCoeff());
  };
  for (int i = 0; i < 5000; ++i) {
    const ArmReference reference = rig.follow();
    ASSERT_EQ(check(reference, kTick_s), "") << "tick " << i;
    outside_m = std::max(outside_m, excess(robot::forward_kinematics(reference.q_rad).translation()));
    target_outside_m = std::max(target_outside_m, excess(reference.X_BEd.translation()));
  }
  std::printf("target up to %.1f mm outside of the box, set-point up to %.2f mm\n", target_outside_m * 1e3,
              outside_m * 1e3);
  EXPECT_GT(target_outside_m, 0.05);
  // The reference stops dead at the wall; the joints need v^2 / 2a, with 4 rad/s^2 at an arm's length of 0.7 m.
  EXPECT_LT(outside_m, config.speed_m_s * config.speed_m_s / (2.0 * 4.0 * 0.7));
}

TEST(ArmController, SaysThatATargetIsOutOfReachAndStandsStillInsideTheLimits) {
  ArmControllerConfig config = cell_config(Clutch::kAbsolute);
  config.workspace_B = {Eigen::Vector3d::Constant(-5.0), Eigen::Vector3d::Constant(5.0)};
  const Pose X_BE = robot::forward_kinematics(usual_posture());
  const auto leaving = [&](double t_s) {
    Pose X = X_BE;
    X.translation().x() += (X_BE.translation().x() < 0 ? -0.4 : 0.4) * std::max(0.0, t_s);  // to 1.6 m and more
    return X;
  };
  ArmRig rig(config, leaving);
  ASSERT_TRUE(rig.measure(usual_posture()));
  rig.engage();
  LimitCheck check(config.joints, usual_posture());
  int unreachable = 0;
  ArmReference reference;
  for (int i = 0; i < 4000; ++i) {
    reference = rig.follow();
    ASSERT_EQ(check(reference, kTick_s), "") << "tick " << i;
    if (!reference.reachable) ++unreachable;
  }
  EXPECT_GT(unreachable, 500);
  EXPECT_FALSE(reference.reachable);
  EXPECT_LT(reference.qd_rad_s.cwiseAbs().maxCoeff(), 1e-6) << "it has come to rest at the border";

  ArmRig far(config, resting_at(math::pose_from({2.5, 0.0, 0.5}, Eigen::Vector3d::Zero())));
  EXPECT_FALSE(far.measure(usual_posture())) << "engaging must not be offered";
}

TEST(ArmController, OffersToEngageOnlyInsideTheWorkspace) {
  ArmControllerConfig config = cell_config(Clutch::kAbsolute);
  const Pose X_BE = robot::forward_kinematics(usual_posture());
  config.workspace_B.min_m = X_BE.translation().array() - 0.05;
  config.workspace_B.max_m = X_BE.translation().array() + 0.05;
  Pose outside = X_BE;
  outside.translation().z() -= 0.06;
  EXPECT_TRUE(ArmRig(config, resting_at(X_BE)).measure(usual_posture()));
  EXPECT_FALSE(ArmRig(config, resting_at(outside)).measure(usual_posture()));
  config.clutch = Clutch::kRelative;  // there it is the arm that has to be inside
  EXPECT_TRUE(ArmRig(config, resting_at(outside)).measure(usual_posture()));
  config.workspace_B.max_m.z() = X_BE.translation().z() - 0.01;
  EXPECT_FALSE(ArmRig(config, resting_at(X_BE)).measure(usual_posture()));
  ArmController nothing_known(config);
  EXPECT_FALSE(nothing_known.track_measured(TimePoint{std::chrono::seconds(1)}, usual_posture()));
}

TEST(ArmController, KeepsTheJointLimitsWhateverTheHandDoes) {
  test::RandomValues random(6);
  for (const Clutch clutch : {Clutch::kAbsolute, Clutch::kRelative}) {
    for (int run = 0; run < 10; ++run) {
      const ArmControllerConfig config = cell_config(clutch);
      const Pose X_BE = robot::forward_kinematics(usual_posture());
      // Teleporting and tumbling every 50 ms.
      Pose X = Pose::Identity();
      const auto wild = [&](double) {
        if (random(0.0, 1.0) < 0.2) X = math::pose_from(random.vector<3>(-2.0, 2.0), random.rotation(3.1));
        return Pose(config.X_BW.inverse() * (random(0.0, 1.0) < 0.5 ? X : X_BE));
      };
      ArmRig rig(config, resting_at(X_BE), wild);
      (void)rig.measure(usual_posture());
      rig.engage();
      LimitCheck check(config.joints, usual_posture());
      for (int i = 0; i < 3000; ++i) {
        const double dt_s = random(0.0, 1.0) < 0.05 ? random(0.002, 0.020) : kTick_s;
        if (i % 700 == 699) {  // coasting and going on
          for (int k = 0; k < 20; ++k) ASSERT_EQ(check(rig.controller.brake(kTick_s), kTick_s), "");
          rig.engage();
        }
        ASSERT_EQ(check(rig.follow(dt_s), dt_s), "") << "run " << run << " tick " << i;
      }
    }
  }
}

TEST(ArmController, IsNoFurtherOnItsWayThanItsSpeedAllows) {
  ArmControllerConfig config = cell_config(Clutch::kRelative);
  config.joints.speed_rad_s *= 2.0;  // so that the flange limits decide
  config.joints.acceleration_rad_s2 *= 10.0;
  const Pose X_BE = robot::forward_kinematics(usual_posture());
  for (const bool turns : {false, true}) {
    const auto leap = [&](double t_s) {
      Pose X = X_BE;
      if (t_s >= 0.0 && !turns) X.translation() += Eigen::Vector3d(0.2, -0.3, -0.2);
      if (t_s >= 0.0 && turns) X.linear() = X.linear() * math::exp_so3({0.5, 0.6, -0.4});
      return X;
    };
    ArmRig rig(config, leap);
    ASSERT_TRUE(rig.measure(usual_posture()));
    rig.engage();
    double arrived_s = 0.0;
    for (int i = 0; i < 2000; ++i) {
      const Pose X = robot::forward_kinematics(rig.follow().q_rad);
      const double way = turns ? angle(X, X_BE) : distance(X, X_BE);
      const double allowed = (turns ? config.speed_rad_s : config.speed_m_s) * rig.now_s;
      ASSERT_LE(way, allowed + 0.003) << "at " << rig.now_s << " s";
      if ((turns ? angle(X, leap(1.0)) : distance(X, leap(1.0))) > 0.002) arrived_s = rig.now_s;
    }
    EXPECT_LT(arrived_s, turns ? 1.1 : 1.9) << "0.88 rad at 1 rad/s, 0.41 m at 0.25 m/s";
  }
}

// What no command exceeds, says the configuration: the flange itself, not only its reference.
double largest_flange_speed(const ArmControllerConfig& config, const ArmRig::Path& path) {
  ArmRig rig(config, path);
  (void)rig.measure(usual_posture());
  rig.engage();
  Pose last = robot::forward_kinematics(usual_posture());
  double largest = 0.0;
  for (int i = 0; i < 4000; ++i) {
    const Pose X = robot::forward_kinematics(rig.follow().q_rad);
    largest = std::max(largest, distance(X, last) / kTick_s);
    last = X;
  }
  return largest;
}

TEST(ArmController, MovesTheFlangeAtItsGreatestSpeedAtMostOnAStraightWay) {
  const ArmControllerConfig config = cell_config(Clutch::kAbsolute);
  const Pose X_BE = robot::forward_kinematics(usual_posture());
  Pose far = X_BE;
  far.translation() += Eigen::Vector3d(0.2, -0.3, -0.2);
  const double speed = largest_flange_speed(config, resting_at(far));
  std::printf("largest flange speed on a straight way: %.4f m/s of %.2f\n", speed, config.speed_m_s);
  EXPECT_LT(speed, 1.02 * config.speed_m_s);
  EXPECT_GT(speed, 0.5 * config.speed_m_s);
}

TEST(ArmController, MovesTheFlangeAtItsGreatestSpeedAtMostWhenTheHandShakes) {
  const ArmControllerConfig config = cell_config(Clutch::kAbsolute);
  const Pose X_BE = robot::forward_kinematics(usual_posture());
  double worst = 0.0;
  for (const double omega : {3.0, 6.0, 12.0}) {
    worst = std::max(worst, largest_flange_speed(config, waving_around(X_BE, 0.25, 0.8, omega)));
  }
  std::printf("largest flange speed of a shaking hand: %.4f m/s of %.2f\n", worst, config.speed_m_s);
  EXPECT_LT(worst, 1.02 * config.speed_m_s);
}

TEST(ArmController, NeverLeavesTheJointRange) {
  ArmControllerConfig config = cell_config(Clutch::kAbsolute);
  const Vector6 q_start = usual_posture();
  config.joints.upper_rad[5] = 0.3;  // the hand turns further than the wrist may
  const Pose X_BE = robot::forward_kinematics(q_start);
  const auto turning = [&](double t_s) {
    Pose X = X_BE;
    X.linear() = X.linear() * math::exp_so3({0.0, 0.0, 0.9 * std::max(0.0, t_s - 1.0)});
    return X;
  };
  ArmRig rig(config, turning);
  ASSERT_TRUE(rig.measure(q_start));
  rig.engage();
  double highest = -1.0;
  for (int i = 0; i < 1500; ++i) highest = std::max(highest, rig.follow().q_rad[5]);
  std::printf("joint 6 reaches %.4f rad of %.4f\n", highest, config.joints.upper_rad[5]);
  EXPECT_LE(highest, config.joints.upper_rad[5] + 1e-9);
}

}  // namespace
}  // namespace embody::teleop
