// A real recording of a hand that grasps a pillow drives the arm controller at 500 Hz in virtual time.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <vector>

#include "core/embodiment/arm_target.hpp"
#include "core/teleop/pose_monitor.hpp"
#include "daemon/app/config_io.hpp"
#include "daemon/app/models.hpp"
#include "drivers/recording/tsv_recording.hpp"
#include "tests/unit/teleop/arm_rig.hpp"

namespace embody::teleop {
namespace {

using std::chrono::milliseconds;
constexpr double kTick_s = 0.002;
constexpr const char* kRecording = EMBODY_SOURCE_DIR "/../shared/data/small_pillow.tsv";
constexpr TimePoint kStart{std::chrono::seconds(100)};

/// A hand pose that the monitor accepted, and the flange target that it means.
struct Sample {
  TimePoint t{};
  Pose X_WM{Pose::Identity()};
  Pose X_BE{Pose::Identity()};
};

std::vector<Sample> hand_poses(const recording::Recording& recording, const Models& models) {
  std::vector<std::size_t> columns;
  for (const auto& name : models.glove.names) {
    const auto& names = recording.marker_names;
    columns.push_back(static_cast<std::size_t>(std::find(names.begin(), names.end(), name.view()) - names.begin()));
  }
  hand::PoseEstimator estimator = models.hand_pose;
  PoseMonitor monitor;
  std::vector<Sample> samples;
  for (std::size_t k = 0; k < recording.frames.size(); ++k) {
    MarkerFrame frame;
    frame.frame_number = k + 1;
    frame.t_capture = kStart + k * milliseconds(10);
    frame.count = columns.size();
    for (std::size_t slot = 0; slot < columns.size(); ++slot) frame.markers[slot] = recording.frames[k][columns[slot]];
    HandPose pose = estimator.step(frame);
    monitor.step(pose);
    if (!pose.valid) continue;
    samples.push_back(
        {pose.t_capture, pose.X_WM, arm_target(models.arm.X_BW, pose.X_WM, models.arm.X_PM, models.arm.X_EP)});
  }
  return samples;
}

/// Signs of shoulder, elbow and wrist: they tell the branch of the inverse kinematics.
std::array<bool, 3> branch(const Vector6& q) {
  const auto& g = robot::kUr10e;
  const double radius =
      g.a2_m * std::cos(q[1]) + g.a3_m * std::cos(q[1] + q[2]) + g.d5_m * std::sin(q[1] + q[2] + q[3]);
  return {radius > 0.0, std::sin(q[2]) > 0.0, std::sin(q[4]) > 0.0};
}

/// Target at `t`, straight between frames.
Pose target_at(const std::vector<Sample>& samples, TimePoint t) {
  const auto after =
      std::upper_bound(samples.begin(), samples.end(), t, [](TimePoint a, const Sample& b) { return a < b.t; });
  if (after == samples.begin()) return samples.front().X_BE;
  if (after == samples.end()) return samples.back().X_BE;
  const Sample& a = *(after - 1);
  return math::interpolate(a.X_BE, after->X_BE, to_seconds(t - a.t) / to_seconds(after->t - a.t));
}

double percentile_95(std::vector<double> values) {
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 95 / 100);
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

struct Drive {
  std::string broken;  ///< first limit that a set-point broke
  int unreachable{0};
  int flips{0};
  double largest_speed_m_s{0.0};  ///< of the flange of the set-points
  double largest_speed_rad_s{0.0};
  std::vector<std::pair<TimePoint, Pose>> flange;  ///< FK of the set-points, each 10 ms from 3 s on
};

Drive drive(const ArmControllerConfig& config, const std::vector<Sample>& samples) {
  Pose X_start = samples.front().X_BE;
  X_start.translation() += Eigen::Vector3d(-0.05, 0.03, 0.08);
  const Vector6 q_start = *robot::solve_nearest(X_start, test::usual_posture());
  ArmController controller(config);
  test::LimitCheck check(config.joints, q_start);
  Drive run;
  std::size_t next = 0;
  Pose last = X_start;
  const int ticks = static_cast<int>(to_seconds(samples.back().t - kStart) / kTick_s);
  for (int i = 0; i < ticks; ++i) {
    const TimePoint now = kStart + i * milliseconds(2);
    while (next < samples.size() && samples[next].t + milliseconds(4) <= now) {
      controller.add(samples[next].t, samples[next].X_WM);
      ++next;
    }
    if (i < 100) {
      const bool ready = controller.track_measured(now, q_start);
      if (i == 99 && !ready) run.broken = "cannot engage";
      continue;
    }
    if (i == 100) controller.engage(now);
    const ArmReference reference = controller.follow(now, kTick_s);
    const std::string broken = check(reference, kTick_s);
    if (run.broken.empty() && !broken.empty()) run.broken = broken + " at tick " + std::to_string(i);
    if (!reference.reachable) ++run.unreachable;
    if (branch(reference.q_rad) != branch(q_start)) ++run.flips;
    const Pose X_BE = robot::forward_kinematics(reference.q_rad);
    run.largest_speed_m_s = std::max(run.largest_speed_m_s, test::distance(X_BE, last) / kTick_s);
    run.largest_speed_rad_s = std::max(run.largest_speed_rad_s, test::angle(X_BE, last) / kTick_s);
    last = X_BE;
    if (i >= 1500 && i % 5 == 0) run.flange.emplace_back(now, X_BE);
  }
  return run;
}

struct Error {
  Duration lag{0};
  double p95_m{1e9};
  double p95_rad{1e9};
};

/// At the constant lag that makes the position error smallest.
Error following_error(const Drive& run, const std::vector<Sample>& samples) {
  Error best;
  for (Duration lag{0}; lag <= milliseconds(250); lag += milliseconds(5)) {
    std::vector<double> distance;
    std::vector<double> angle;
    for (const auto& [t, X_BE] : run.flange) {
      const Pose X_BEt = target_at(samples, t - lag);
      distance.push_back(test::distance(X_BE, X_BEt));
      angle.push_back(test::angle(X_BE, X_BEt));
    }
    const double p95_m = percentile_95(distance);
    if (p95_m < best.p95_m) best = {lag, p95_m, percentile_95(angle)};
  }
  return best;
}

class RealRecording : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kRecording)) GTEST_SKIP() << "the real recording is not here: " << kRecording;
    const auto config = config::load_config(EMBODY_SOURCE_DIR "/config/embody.toml");
    ASSERT_TRUE(config.ok()) << config.error().detail.view();
    const auto models = make_models(*config);
    ASSERT_TRUE(models.ok()) << models.error().detail.view();
    const auto recording = recording::load_tsv(kRecording);
    ASSERT_TRUE(recording.ok()) << recording.error().detail.view();
    ASSERT_EQ(recording->frames.size(), 3000U);
    samples = hand_poses(*recording, *models);
    arm = models->arm;
  }
  std::vector<Sample> samples;
  ArmControllerConfig arm;
};

TEST_F(RealRecording, EveryFrameIsAPlausibleHand) {
  EXPECT_EQ(samples.size(), 3000U);
}

TEST_F(RealRecording, IsFollowedInsideTheLimitsOfTheDemo) {
  arm.speed_m_s = 0.6;
  arm.speed_rad_s = 2.5;
  const Drive run = drive(arm, samples);
  const Error error = following_error(run, samples);
  std::printf("limits of the demo: lag %.0f ms, p95 %.2f mm and %.4f rad; flange at most %.3f m/s, %.3f rad/s\n",
              to_seconds(error.lag) * 1e3, error.p95_m * 1e3, error.p95_rad, run.largest_speed_m_s,
              run.largest_speed_rad_s);
  EXPECT_EQ(run.broken, "");
  EXPECT_EQ(run.unreachable, 0);
  EXPECT_EQ(run.flips, 0);
  EXPECT_LT(error.p95_m, 0.005);
  EXPECT_LT(error.p95_rad, 0.03);
  EXPECT_LE(error.lag, milliseconds(60));
}

TEST_F(RealRecording, KeepsTheDefaultLimitsAlthoughTheHandIsFaster) {
  const Drive run = drive(arm, samples);
  const Error error = following_error(run, samples);
  std::printf("default limits: lag %.0f ms, p95 %.2f mm and %.4f rad; flange at most %.3f m/s, %.3f rad/s\n",
              to_seconds(error.lag) * 1e3, error.p95_m * 1e3, error.p95_rad, run.largest_speed_m_s,
              run.largest_speed_rad_s);
  EXPECT_EQ(run.broken, "");
  EXPECT_EQ(run.unreachable, 0);
  EXPECT_EQ(run.flips, 0);
  EXPECT_LT(error.p95_m, 0.1);
}

TEST_F(RealRecording, NeverMovesTheFlangeFasterThanConfigured) {
  for (const double scale : {1.0, 2.4}) {
    ArmControllerConfig config = arm;
    config.speed_m_s = 0.25 * scale;
    config.speed_rad_s = 1.0 * scale;
    const Drive run = drive(config, samples);
    EXPECT_LE(run.largest_speed_m_s, 1.02 * config.speed_m_s);
    EXPECT_LE(run.largest_speed_rad_s, 1.02 * config.speed_rad_s);
  }
}

}  // namespace
}  // namespace embody::teleop
