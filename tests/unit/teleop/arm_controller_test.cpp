#include "core/teleop/arm_controller.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <limits>

#include "core/embodiment/arm_target.hpp"
#include "tests/support/heap_counter.hpp"
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

/// A posture away from singularities whose flange is inside the box.
Vector6 random_posture(test::RandomValues& random, const Box& box) {
  while (true) {
    const Vector6 q = usual_posture() + random.vector<6>(-0.9, 0.9);
    const Eigen::Vector3d p = robot::forward_kinematics(q).translation();
    const bool inside = (p.array() > box.min_m.array()).all() && (p.array() < box.max_m.array()).all();
    if (inside && robot::manipulability(q) > 0.03) return q;
  }
}

TEST(ArmController, TargetsWhatTheEmbodimentSays) {
  test::RandomValues random(1);
  const ArmControllerConfig config = cell_config(Clutch::kAbsolute);
  const Pose X_BE = robot::forward_kinematics(usual_posture());
  ArmRig rig(config, resting_at(X_BE));
  EXPECT_LT(distance(arm_target(config.X_BW, rig.hand_for(X_BE), config.X_PM, config.X_EP), X_BE), 1e-12);
  ASSERT_TRUE(rig.measure(usual_posture()));
  rig.engage();
  const ArmReference reference = rig.follow();
  EXPECT_LT(distance(reference.X_BEd, X_BE), 1e-9);
  EXPECT_LT(angle(reference.X_BEd, X_BE), 1e-9);
  EXPECT_LT((reference.q_rad - usual_posture()).cwiseAbs().maxCoeff(), 1e-9) << "already there";
}

TEST(ArmController, NeverJumpsWhenItEngagesFromAnyConfigurationWithAnyHandPose) {
  test::RandomValues random(2);
  for (int run = 0; run < 200; ++run) {
    const ArmControllerConfig config = cell_config(run % 2 == 0 ? Clutch::kAbsolute : Clutch::kRelative);
    const Vector6 q_start = random_posture(random, config.workspace_B);
    const Pose X_BEt = robot::forward_kinematics(random_posture(random, config.workspace_B));
    ArmRig rig(config, resting_at(X_BEt));
    (void)rig.measure(q_start);
    rig.engage();
    LimitCheck check(config.joints, q_start);
    const ArmReference first = rig.follow();
    // One tick of the full acceleration is all that a first set-point may move.
    ASSERT_TRUE(
        ((first.q_rad - q_start).array().abs() <= config.joints.acceleration_rad_s2.array() * kTick_s * kTick_s + 1e-12)
            .all())
        << "run " << run << ": " << (first.q_rad - q_start).transpose();
    ASSERT_EQ(check(first, kTick_s), "") << "run " << run;
    for (int i = 0; i < 1000; ++i) ASSERT_EQ(check(rig.follow(), kTick_s), "") << "run " << run << " tick " << i;
  }
}

TEST(ArmController, ConvergesOntoTheHandWithTheAbsoluteClutch) {
  test::RandomValues random(3);
  int reached = 0;
  for (int run = 0; run < 50; ++run) {
    const ArmControllerConfig config = cell_config(Clutch::kAbsolute);
    const Vector6 q_start = usual_posture() + random.vector<6>(-0.3, 0.3);
    const Vector6 q_end = q_start + random.vector<6>(-0.3, 0.3);
    const Pose X_BEt = robot::forward_kinematics(q_end);
    ArmRig rig(config, resting_at(X_BEt));
    ASSERT_TRUE(rig.measure(q_start));
    rig.engage();
    ArmReference reference;
    bool all_reachable = true;
    for (int i = 0; i < 5000; ++i) all_reachable = (reference = rig.follow()).reachable && all_reachable;
    if (!all_reachable) continue;
    ++reached;
    ASSERT_LT(distance(robot::forward_kinematics(reference.q_rad), X_BEt), 1e-6) << "run " << run;
    ASSERT_LT(angle(robot::forward_kinematics(reference.q_rad), X_BEt), 1e-6) << "run " << run;
  }
  EXPECT_EQ(reached, 50);
}

TEST(ArmController, RepeatsTheMotionOfTheHandWithTheRelativeClutch) {
  test::RandomValues random(4);
  for (int run = 0; run < 20; ++run) {
    const ArmControllerConfig config = cell_config(Clutch::kRelative);
    const Vector6 q_start = usual_posture() + random.vector<6>(-0.2, 0.2);
    const Pose X_BE0 = robot::forward_kinematics(q_start);
    const Pose X_BEt = math::pose_from(random.vector<3>(-0.5, 0.5), random.rotation(3.0));  // the hand is elsewhere
    ArmRig rig(config, waving_around(X_BEt, 0.1, 0.2, 1.0));
    ASSERT_TRUE(rig.measure(q_start));
    rig.engage();
    const Pose X_BEt0 = rig.target();
    double worst_m = 0.0;
    double worst_rad = 0.0;
    for (int i = 0; i < 3000; ++i) {
      const ArmReference reference = rig.follow();
      ASSERT_TRUE(reference.reachable);
      const Pose X_BEs = robot::forward_kinematics(reference.q_rad);
      const Pose X_BEn = rig.target();
      Pose X_expected = Pose::Identity();
      X_expected.translation() = X_BE0.translation() + X_BEn.translation() - X_BEt0.translation();
      X_expected.linear() = X_BEn.linear() * X_BEt0.linear().transpose() * X_BE0.linear();
      worst_m = std::max(worst_m, distance(X_BEs, X_expected));
      worst_rad = std::max(worst_rad, angle(X_BEs, X_expected));
    }
    ASSERT_LT(worst_m, 1e-3) << "run " << run;
    ASSERT_LT(worst_rad, 4e-3) << "run " << run;
  }
}

TEST(ArmController, AbsorbsAStepOfOneFrameWithinTheJointLimits) {
  const double step_rad = 4.65 * M_PI / 180.0;
  for (const Clutch clutch : {Clutch::kAbsolute, Clutch::kRelative}) {
    const ArmControllerConfig config = cell_config(clutch);
    const Pose X_BE = robot::forward_kinematics(usual_posture());
    const auto path = [&](double t_s) {
      Pose X = X_BE;
      if (t_s >= 0.5) X.linear() = X.linear() * math::exp_so3(step_rad * Eigen::Vector3d(0.6, 0.0, 0.8));
      return X;
    };
    ArmRig rig(config, path);
    ASSERT_TRUE(rig.measure(usual_posture()));
    rig.engage();
    LimitCheck check(config.joints, usual_posture());
    double settled_s = 0.0;
    for (int i = 0; i < 2000; ++i) {
      const ArmReference reference = rig.follow();
      ASSERT_TRUE(reference.reachable);
      ASSERT_EQ(check(reference, kTick_s), "") << "tick " << i;
      if (angle(robot::forward_kinematics(reference.q_rad), path(rig.now_s)) > 1e-3) settled_s = rig.now_s;
    }
    std::printf("the step of 4.65 degrees is absorbed within %.0f ms\n", (settled_s - 0.5) * 1e3);
    EXPECT_GT(settled_s, 0.5);
    EXPECT_LT(settled_s, 1.0);
    EXPECT_LT(angle(robot::forward_kinematics(rig.follow().q_rad), path(rig.now_s)), 1e-6);
  }
}

TEST(ArmController, GoesOnFromWhereBrakingLeftTheSetPoint) {
  for (const Clutch clutch : {Clutch::kAbsolute, Clutch::kRelative}) {
    const ArmControllerConfig config = cell_config(clutch);
    const Pose X_BE = robot::forward_kinematics(usual_posture());
    ArmRig rig(config, waving_around(X_BE, 0.2, 0.3, 2.0));
    ASSERT_TRUE(rig.measure(usual_posture()));
    rig.engage();
    LimitCheck check(config.joints, usual_posture());
    for (int i = 0; i < 400; ++i) ASSERT_EQ(check(rig.follow(), kTick_s), "");
    int ticks = 0;
    while (!rig.controller.at_rest() && ++ticks < 1000) {
      ASSERT_EQ(check(rig.controller.brake(kTick_s), kTick_s), "");
      rig.now_s += kTick_s;
    }
    EXPECT_TRUE(rig.controller.at_rest());
    rig.now_s += 0.1;  // the hand goes on meanwhile
    rig.feed();
    rig.engage();
    for (int i = 0; i < 3000; ++i) ASSERT_EQ(check(rig.follow(), kTick_s), "") << "tick " << i;
    if (clutch == Clutch::kAbsolute) {
      EXPECT_LT(distance(robot::forward_kinematics(rig.follow().q_rad), rig.target()), 2e-3);
    }
  }
}

TEST(ArmController, StandsStillOnPosesThatAreNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const Clutch clutch : {Clutch::kAbsolute, Clutch::kRelative}) {
    for (const double bad : {nan, inf, -inf}) {
      for (const bool in_rotation : {false, true}) {
        const ArmControllerConfig config = cell_config(clutch);
        const Pose X_BE = robot::forward_kinematics(usual_posture());
        ArmRig* self = nullptr;
        const auto broken = [&](double t_s) {
          Pose X = self->hand_for(X_BE);
          if (t_s > 0.3 && in_rotation) X.linear()(0, 1) = bad;
          if (t_s > 0.3 && !in_rotation) X.translation().y() = bad;
          return X;
        };
        ArmRig rig(config, resting_at(X_BE), broken);
        self = &rig;
        ASSERT_TRUE(rig.measure(usual_posture()));
        rig.engage();
        LimitCheck check(config.joints, usual_posture());
        ArmReference reference;
        for (int i = 0; i < 1000; ++i) {
          reference = rig.follow();
          ASSERT_EQ(check(reference, kTick_s), "") << "tick " << i << " bad " << bad;
        }
        EXPECT_FALSE(reference.reachable) << "bad " << bad << (in_rotation ? " rotation" : " translation");
        EXPECT_LT((reference.q_rad - usual_posture()).cwiseAbs().maxCoeff(), 1e-3)
            << "moved on bad " << bad << (in_rotation ? " rotation" : " translation");
        if (clutch == Clutch::kAbsolute) {
          EXPECT_FALSE(rig.measure(usual_posture())) << "engaging must not be offered";
        }
      }
    }
  }
}

TEST(ArmController, OffersNoRelativeClutchOnAPoseThatIsNotFinite) {
  const ArmControllerConfig config = cell_config(Clutch::kRelative);
  Pose broken = Pose::Identity();
  broken.translation().x() = std::numeric_limits<double>::quiet_NaN();
  ArmRig rig(config, resting_at(Pose::Identity()), resting_at(broken));
  EXPECT_FALSE(rig.measure(usual_posture()));
}

TEST(ArmController, UsesNoHeap) {
  const ArmControllerConfig config = cell_config(Clutch::kAbsolute);
  const Pose X_BE = robot::forward_kinematics(usual_posture());
  ArmController controller(config);
  const Pose X_WM = config.X_BW.inverse() * X_BE * config.X_EP * config.X_PM;
  TimePoint t{std::chrono::seconds(1)};
  const std::uint64_t before = test::heap_allocations();
  for (int i = 0; i < 100; ++i) {
    t += std::chrono::milliseconds(10);
    controller.add(t, X_WM);
    (void)controller.track_measured(t, usual_posture());
  }
  controller.engage(t);
  for (int i = 0; i < 100; ++i) (void)controller.follow(t, kTick_s);
  (void)controller.brake(kTick_s);
  EXPECT_EQ(test::heap_allocations(), before);
}

}  // namespace
}  // namespace embody::teleop
