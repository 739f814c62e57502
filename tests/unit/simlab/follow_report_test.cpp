#include "daemon/simlab/follow_report.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/embodiment/arm_target.hpp"
#include "core/hand/synthetic_motion.hpp"
#include "core/robot/ur_kinematics.hpp"
#include "daemon/app/config_io.hpp"
#include "daemon/simlab/demo_recording.hpp"

namespace embody::sim {
namespace {

using std::chrono::milliseconds;
constexpr TimePoint kStart{std::chrono::seconds(100)};
constexpr double kDuration_s = 12.0;

/// Joint path whose flange moves at some 0.2 m/s.
Vector6 joints_at(double t_s) {
  Vector6 q;
  q << 0.0, -1.5708, 1.5708, -1.5708, -1.5708, 0.0;
  q[0] += 0.25 * std::sin(1.3 * t_s);
  q[1] += 0.10 * std::sin(0.9 * t_s);
  q[2] += 0.12 * std::sin(1.1 * t_s + 1.0);
  q[5] += 0.30 * std::sin(0.7 * t_s);
  return q;
}
double finger_at(double t_s, std::size_t motor) {
  return 0.6 + 0.4 * std::sin((1.0 + 0.3 * static_cast<double>(motor)) * t_s);
}

/// A robot and its target, both as functions of time (s since the start of playback).
struct Scene {
  std::function<Vector6(double)> target{joints_at};
  std::function<Vector6(double)> arm{joints_at};
  std::function<double(double, std::size_t)> finger{finger_at};
  std::function<bool(double)> tracking{[](double t_s) { return t_s > 0.5; }};
  double arm_log_end_s{kDuration_s};
  double hand_log_end_s{kDuration_s};
};

Scene late_by(double lag_s) {
  Scene scene;
  scene.arm = [lag_s](double t_s) { return joints_at(t_s - lag_s); };
  scene.finger = [lag_s](double t_s, std::size_t motor) { return finger_at(t_s - lag_s, motor); };
  return scene;
}

FollowReport judge_scene(const Scene& scene) {
  std::vector<TargetSample> targets;
  for (double t = 0.0; t < kDuration_s; t += 0.01) {
    TargetSample sample{kStart + from_seconds(t), robot::forward_kinematics(scene.target(t)), {}};
    for (std::size_t motor = 0; motor < 3; ++motor) sample.q_hand_rad[motor] = finger_at(t, motor);
    targets.push_back(sample);
  }
  std::vector<UrSample> arm;
  for (double t = -1.0; t < scene.arm_log_end_s; t += 0.002) {
    UrSample sample;
    sample.t = kStart + from_seconds(t);
    sample.q_rad = scene.arm(t);
    sample.qd_rad_s = (scene.arm(t + 1e-4) - scene.arm(t - 1e-4)) / 2e-4;
    sample.program_state = scene.tracking(t) ? ProgramState::kTracking : ProgramState::kHold;
    arm.push_back(sample);
  }
  std::vector<HandSample> hand;
  for (double t = -1.0; t < scene.hand_log_end_s; t += 0.01) {
    HandSample sample;
    sample.t = kStart + from_seconds(t);
    sample.count = 3;
    for (std::size_t motor = 0; motor < 3; ++motor) sample.q_rad[motor] = scene.finger(t, motor);
    hand.push_back(sample);
  }
  return judge(targets, arm, hand);
}

void expect_failure(const Scene& scene, const std::string& reason) {
  const FollowReport report = judge_scene(scene);
  EXPECT_FALSE(report.followed);
  EXPECT_EQ(report.reason.substr(0, reason.size()), reason);
}

TEST(FollowReport, ARobotThatFollowsWithAConstantLagHasFollowedWithThatLag) {
  for (const int lag_ms : {0, 20, 60, 120, 200, 250}) {
    const FollowReport report = judge_scene(late_by(lag_ms * 1e-3));
    EXPECT_TRUE(report.followed) << lag_ms << " ms: " << report.reason;
    EXPECT_EQ(report.reason, "");
    EXPECT_NEAR(report.arm_lag_s, lag_ms * 1e-3, 0.0021);
    EXPECT_NEAR(report.hand_lag_s, lag_ms * 1e-3, 0.0041);
    EXPECT_LT(report.arm_error_m, 1e-3);
    EXPECT_LT(report.arm_error_rad, 2e-3);
    EXPECT_LT(report.hand_error_rad, 3e-3);
    EXPECT_NEAR(report.path_ratio, 1.0, 0.01);
    EXPECT_NEAR(report.first_tracking_s, 0.5, 0.005);
    EXPECT_DOUBLE_EQ(report.engaged_fraction, 1.0);
    EXPECT_NEAR(report.judged_s, kDuration_s - 3.5, 0.05);
    EXPECT_GT(report.largest_joint_speed_rad_s, 0.2);
    EXPECT_LT(report.largest_joint_speed_rad_s, 0.5);
  }
}

TEST(FollowReport, ARobotThatStandsStillHasNotFollowed) {
  Scene scene;
  scene.arm = [](double) { return joints_at(0.0); };
  expect_failure(scene, "arm position error (p95)");
}

TEST(FollowReport, ARobotThatDriftsAwayHasNotFollowed) {
  Scene scene;
  scene.arm = [](double t_s) {
    Vector6 q = joints_at(t_s);
    q[0] += 0.01 * t_s;
    return q;
  };
  expect_failure(scene, "arm position error (p95)");
  scene.arm = [](double t_s) {
    Vector6 q = joints_at(t_s);
    q[5] += 0.015 * t_s;  // turns the hand without moving the flange
    return q;
  };
  expect_failure(scene, "arm orientation error (p95)");
}

TEST(FollowReport, ARobotThatIsLaterThanAllowedHasNotFollowed) {
  expect_failure(late_by(0.45), "arm position error (p95)");
}

TEST(FollowReport, ARobotThatShakesHasNotFollowed) {
  Scene scene;
  scene.arm = [](double t_s) {
    Vector6 q = joints_at(t_s);
    q[0] += 0.006 * std::sin(2.0 * M_PI * 17.0 * t_s);  // some 5 mm
    return q;
  };
  expect_failure(scene, "path length");
}

TEST(FollowReport, ARobotThatLeavesOutTheSmallMotionsHasNotFollowed) {
  Scene scene;
  scene.target = [](double t_s) {
    Vector6 q = joints_at(t_s);
    q[0] += 0.010 * std::sin(2.0 * M_PI * 5.0 * t_s);
    return q;
  };
  expect_failure(scene, "path length");
}

TEST(FollowReport, AnExcursionIsForgivenForAFewPercentOfTheTimeOnly) {
  const auto leaves_for = [](double duration_s) {
    Scene scene;
    scene.arm = [duration_s](double t_s) {
      Vector6 q = joints_at(t_s);
      const double s = (t_s - 6.0) / duration_s;
      if (s > 0.0 && s < 1.0) q[0] += 0.06 * std::min(1.0, 4.0 * std::min(s, 1.0 - s));  // some 40 mm
      return q;
    };
    return scene;
  };
  EXPECT_TRUE(judge_scene(leaves_for(0.2)).followed) << judge_scene(leaves_for(0.2)).reason;
  expect_failure(leaves_for(1.0), "arm position error (p95)");  // 12 % of the judged time
}

TEST(FollowReport, ARobotThatLosesTrackingHasNotFollowed) {
  Scene scene;
  scene.tracking = [](double t_s) { return t_s > 0.5 && !(t_s > 6.0 && t_s < 6.6); };
  expect_failure(scene, "time without tracking");
  scene.tracking = [](double t_s) { return t_s > 5.5; };
  expect_failure(scene, "time until the arm tracked");
  scene.tracking = [](double) { return false; };
  expect_failure(scene, "the arm never tracked");
  scene.tracking = [](double t_s) { return t_s < 0.0; };  // before playback only
  expect_failure(scene, "the arm never tracked");
  scene.tracking = [](double t_s) { return t_s > 8.5; };
  expect_failure(scene, "less than a second");
}

TEST(FollowReport, AHandThatDoesNotMoveHasNotFollowed) {
  Scene scene;
  scene.finger = [](double, std::size_t) { return 0.6; };
  expect_failure(scene, "hand joint error (p95)");
  scene.finger = [](double t_s, std::size_t motor) { return motor == 2 ? 0.0 : finger_at(t_s, motor); };
  expect_failure(scene, "hand joint error (p95)");
  scene = {};
  scene.hand_log_end_s = -0.5;  // the hand was never heard of
  expect_failure(scene, "the log of the simulated robot ends before the recording");
}

TEST(FollowReport, NeedsFramesAndARobot) {
  EXPECT_EQ(judge({}, {}, {}).reason, "no frame was sent");
  const std::vector<TargetSample> targets{{kStart, Pose::Identity(), {}}};
  EXPECT_EQ(judge(targets, {}, {}).reason, "the arm never tracked");
  EXPECT_FALSE(judge(targets, {}, {}).followed);
}

TEST(FollowReport, ARobotWhoseLogEndsEarlyHasNotFollowed) {
  Scene scene;
  scene.arm_log_end_s = 4.5;  // it was gone after one second of the judged time
  EXPECT_FALSE(judge_scene(scene).followed) << "the arm's log covers 1 s of " << judge_scene(scene).judged_s;
  scene = {};
  scene.hand_log_end_s = 3.6;
  EXPECT_FALSE(judge_scene(scene).followed) << "the hand's log covers 0.1 s of " << judge_scene(scene).judged_s;
}

TEST(UngatedTargets, AreTheEmbodimentOfTheRecordedHandForEveryFrameThatWasSent) {
  const auto config = config::load_config(EMBODY_SOURCE_DIR "/config/embody.toml");
  ASSERT_TRUE(config.ok()) << config.error().detail.view();
  const auto models = make_models(*config);
  ASSERT_TRUE(models.ok()) << models.error().detail.view();
  recording::Recording recording = make_demo_recording(2.0);
  recording.frames[7][0].visible = false;  // a marker on the back of the hand: this frame has no pose
  std::vector<SentFrame> sent;
  for (std::size_t k = 0; k < recording.frames.size(); k += 2) sent.push_back({k, kStart + k * milliseconds(10)});
  sent.insert(sent.begin() + 4, SentFrame{7, kStart + milliseconds(70)});

  const std::vector<TargetSample> targets = ungated_targets(*models, recording, sent);
  ASSERT_EQ(targets.size(), sent.size() - 1);
  const hand::SyntheticMotion motion({100.0, 2.0, kDemoSeed});
  std::size_t next = 0;
  for (const SentFrame& frame : sent) {
    if (frame.index == 7) continue;
    const TargetSample& target = targets[next++];
    EXPECT_EQ(target.t, frame.t_sent);
    const Pose X_BE = arm_target(models->arm.X_BW, motion.frame(frame.index).X_WM, models->arm.X_PM, models->arm.X_EP);
    EXPECT_LT((target.X_BE.translation() - X_BE.translation()).norm(), 3e-3);
    EXPECT_LT(math::angle_between(target.X_BE.linear(), X_BE.linear()), 0.02);
    for (std::size_t motor = 0; motor < models->embodiment.motor_count(); ++motor) {
      EXPECT_GE(target.q_hand_rad[motor], models->embodiment.lower_rad(motor) - 1e-9);
      EXPECT_LE(target.q_hand_rad[motor], models->embodiment.upper_rad(motor) + 1e-9);
    }
  }
}

}  // namespace
}  // namespace embody::sim
