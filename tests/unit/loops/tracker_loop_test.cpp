#include "daemon/loops/tracker_loop.hpp"

#include <gtest/gtest.h>

#include "tests/unit/loops/fakes.hpp"

namespace embody {
namespace {

using transport::now;

/// A tracker loop over a fake tracker with the paper's glove.
class TrackerBench {
 public:
  explicit TrackerBench(const teleop::PosePredictorConfig& predictor = {})
      : baton(tracker),
        loop(baton, hand::HandPoseEstimator(hand::paper_glove(), hand::paper_calibration()), teleop::PoseMonitor(),
             teleop::PosePredictor(predictor), edges) {
    tracker.fd = ready.get();
  }
  /// Frame with the three markers on the back of a hand that moves slowly.
  static void fill(MarkerFrame& frame, std::uint64_t number, TimePoint t_capture) {
    frame = {};
    frame.frame_number = number;
    frame.t_capture = frame.t_arrival = t_capture;
    frame.count = hand::paper_glove().names.size();
    const double x = 1e-5 * static_cast<double>(number);
    frame.markers[0] = {{x + 0.110, 0.135, 0.460}, true};
    frame.markers[1] = {{x + 0.062, 0.161, 0.450}, true};
    frame.markers[2] = {{x + 0.066, 0.130, 0.452}, true};
  }
  std::uint64_t run() {
    baton.pass_to_loop(*tracker.connect());
    test::WatchedThread thread(edges.stop, [this] { loop.run(); });
    return thread.join();
  }

  test::EventFd ready{true};
  test::FakeTracker tracker;
  Edges edges;
  TrackerBaton baton;
  TrackerLoop loop;
};

TEST(TrackerLoop, UsesEveryBufferedFrameOnceAndPublishesTheNewest) {
  TrackerBench bench;
  constexpr std::uint64_t kFrames = 1000;
  std::uint64_t number = 0;
  const TimePoint start = now();
  bench.tracker.on_read = [&](MarkerFrame& frame) {
    if (number == kFrames) {
      bench.edges.stop = true;
      return IoStatus::kEmpty;
    }
    ++number;
    TrackerBench::fill(frame, number, start + number * std::chrono::milliseconds(10));
    return IoStatus::kDone;
  };
  EXPECT_EQ(bench.run(), 0U) << "heap uses";
  EXPECT_EQ(bench.edges.counters.frames_received, kFrames);
  EXPECT_EQ(bench.edges.counters.frames_used, kFrames);
  EXPECT_EQ(bench.edges.counters.poses_invalid, 0U);
  ASSERT_TRUE(bench.edges.pose_to_arm.update());
  const HandPose& pose = bench.edges.pose_to_arm.get();
  EXPECT_TRUE(pose.valid);
  EXPECT_EQ(pose.frame_number, kFrames);
  EXPECT_EQ(pose.sequence, kFrames);
  EXPECT_EQ(pose.streak, kFrames) << "each frame has stepped the pose path, in order";
  EXPECT_LE(pose.t_decoded, pose.t_estimated);
  ASSERT_TRUE(bench.edges.frame_to_fingers.update());
  EXPECT_EQ(bench.edges.frame_to_fingers.get().sequence, kFrames);
  EXPECT_EQ(bench.edges.frame_to_fingers.get().frame.frame_number, kFrames);
  EXPECT_TRUE(wait_for_input(bench.edges.fingers_wake.fd(), -1, Duration{0})) << "the finger loop was woken";
}

TEST(TrackerLoop, DoesNotTrustPosesAfterTheLabelsMayHaveChanged) {
  TrackerBench bench;
  constexpr std::uint64_t kFrames = 200, kBefore = 100;
  std::uint64_t number = 0;
  const TimePoint start = now();
  bench.tracker.on_read = [&](MarkerFrame& frame) {
    if (number == kFrames) {
      bench.edges.stop = true;
      return IoStatus::kEmpty;
    }
    ++number;
    TrackerBench::fill(frame, number, start + number * std::chrono::milliseconds(10));
    frame.label_epoch = number <= kBefore ? 7 : 8;
    return IoStatus::kDone;
  };
  EXPECT_EQ(bench.run(), 0U) << "heap uses";
  EXPECT_EQ(bench.edges.counters.poses_invalid, 50U) << "the first epoch needs no trial, the second one does";
  ASSERT_TRUE(bench.edges.pose_to_arm.update());
  EXPECT_EQ(bench.edges.pose_to_arm.get().streak, kFrames - kBefore - 50) << "motion does not go on across it";
}

TEST(TrackerLoop, PredictsThePoseOfTheArmAndLeavesThatOfTheFingersAsMeasured) {
  teleop::PosePredictorConfig predictor;
  predictor.ahead = std::chrono::milliseconds(50);
  TrackerBench bench(predictor);
  std::uint64_t number = 0;
  const TimePoint start = now();
  bench.tracker.on_read = [&](MarkerFrame& frame) {
    if (number == 300) {
      bench.edges.stop = true;
      return IoStatus::kEmpty;
    }
    ++number;
    TrackerBench::fill(frame, 100 * number, start + number * std::chrono::milliseconds(10));  // 0.1 m/s
    return IoStatus::kDone;
  };
  EXPECT_EQ(bench.run(), 0U) << "heap uses";
  ASSERT_TRUE(bench.edges.pose_to_arm.update());
  ASSERT_TRUE(bench.edges.frame_to_fingers.update());
  const HandPose& arm = bench.edges.pose_to_arm.get();
  const HandPose& fingers = bench.edges.frame_to_fingers.get().pose;
  const Eigen::Vector3d ahead_m = arm.X_WM.translation() - fingers.X_WM.translation();
  EXPECT_LT((ahead_m - Eigen::Vector3d(0.005, 0.0, 0.0)).norm(), 1e-6);
  EXPECT_TRUE(arm.valid);
  EXPECT_EQ(arm.streak, fingers.streak);
  EXPECT_EQ(arm.sequence, fingers.sequence);
  EXPECT_EQ(arm.t_capture, fingers.t_capture);
}

TEST(TrackerLoop, CountsFramesWithoutAHandAndMarksTheirPose) {
  TrackerBench bench;
  std::uint64_t number = 0;
  bench.tracker.on_read = [&](MarkerFrame& frame) {
    if (number == 100) {
      bench.edges.stop = true;
      return IoStatus::kEmpty;
    }
    TrackerBench::fill(frame, ++number, now());
    if (number % 4 == 0) frame.markers[1].visible = false;
    return IoStatus::kDone;
  };
  bench.run();
  EXPECT_EQ(bench.edges.counters.frames_received, 100U);
  EXPECT_EQ(bench.edges.counters.frames_used, 75U);
  EXPECT_EQ(bench.edges.counters.poses_invalid, 25U);
  ASSERT_TRUE(bench.edges.pose_to_arm.update());
  EXPECT_FALSE(bench.edges.pose_to_arm.get().valid) << "the newest frame, number 100, lacks a marker";
  EXPECT_EQ(bench.edges.pose_to_arm.get().streak, 0U);
}

TEST(TrackerLoop, GivesABrokenTrackerBackAfterUsingWhatItHadSent) {
  TrackerBench bench;
  std::uint64_t number = 0;
  bench.tracker.on_read = [&](MarkerFrame& frame) {
    if (number == 3) {
      bench.edges.stop = true;
      return IoStatus::kDisconnected;
    }
    TrackerBench::fill(frame, ++number, now());
    return IoStatus::kDone;
  };
  bench.run();
  EXPECT_TRUE(bench.baton.with_links());
  EXPECT_EQ(bench.baton.fd(), -1);
  ASSERT_TRUE(bench.edges.pose_to_arm.update());
  EXPECT_EQ(bench.edges.pose_to_arm.get().frame_number, 3U);
}

TEST(TrackerLoop, GivesTheTrackerBackWhenLinksRevokeItAndTakesItAgain) {
  TrackerBench bench;
  std::atomic<std::uint64_t> reads{0};
  bench.tracker.on_read = [&](MarkerFrame&) {
    ++reads;
    return IoStatus::kEmpty;
  };
  bench.baton.pass_to_loop(*bench.tracker.connect());
  test::WatchedThread thread(bench.edges.stop, [&] { bench.loop.run(); });
  EXPECT_TRUE(test::eventually([&] { return reads > 0; }));
  bench.baton.revoke();
  EXPECT_TRUE(test::eventually([&] { return bench.baton.with_links(); }));
  const std::uint64_t before = reads;
  bench.baton.pass_to_loop(*bench.tracker.connect());
  EXPECT_TRUE(test::eventually([&] { return reads > before; }));
  bench.edges.stop = true;
  EXPECT_EQ(thread.join(), 0U) << "heap uses";
}

TEST(TrackerLoop, BeatsWithoutATracker) {
  TrackerBench bench;
  test::WatchedThread thread(bench.edges.stop, [&] { bench.loop.run(); });
  EXPECT_TRUE(test::eventually([&] { return bench.edges.heartbeats.tracker > 3; }));
  bench.edges.stop = true;
  thread.join();
}

}  // namespace
}  // namespace embody
