#include "daemon/loops/finger_loop.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "core/hand/synthetic_motion.hpp"
#include "daemon/app/config_io.hpp"
#include "daemon/app/models.hpp"
#include "tests/unit/loops/fakes.hpp"

namespace embody {
namespace {

using std::chrono::milliseconds;
using test::eventually;
using transport::now;

Models shipped_models() {
  const auto config = config::load_config(EMBODY_SOURCE_DIR "/config/embody.toml");
  if (!config) throw std::runtime_error(std::string(config.error().detail.view()));
  Result<Models> models = make_models(*config);
  if (!models) throw std::runtime_error(std::string(models.error().detail.view()));
  return std::move(models).value();
}

/// A finger loop with the shipped models, and a synthetic hand to feed it.
class FingerBench {
 public:
  explicit FingerBench(const SlowDown& slow_down = {})
      : models(shipped_models()), loop(models.fingers, models.filter, models.embodiment, slow_down, edges) {}

  void publish(std::size_t k) {
    TrackedFrame tracked;
    tracked.frame = motion.frame(k).markers;
    tracked.frame.t_capture = tracked.frame.t_arrival = now();
    tracked.pose = models.hand_pose.step(tracked.frame);
    tracked.pose.sequence = tracked.sequence = ++sequence;
    edges.frame_to_fingers.publish(tracked);
    edges.fingers_wake.notify();
  }
  [[nodiscard]] std::uint64_t used() const { return edges.counters.finger_frames; }

  hand::SyntheticMotion motion;
  Models models;
  Edges edges;
  FingerLoop loop;
  std::uint64_t sequence{0};
};

TEST(FingerLoop, TurnsEachFrameIntoAFingerTarget) {
  FingerBench bench;
  test::WatchedThread thread(bench.edges.stop, [&] { bench.loop.run(); });
  for (std::size_t k = 0; k < 20; ++k) {
    bench.publish(k);
    ASSERT_TRUE(eventually([&] { return bench.used() == k + 1; })) << "frame " << k;
    ASSERT_TRUE(bench.edges.target_to_hand.update());
    const FingerTarget& target = bench.edges.target_to_hand.get();
    EXPECT_TRUE(target.valid);
    EXPECT_EQ(target.frame_number, k + 1);
    EXPECT_EQ(target.joint_count, bench.models.embodiment.motor_count());
    EXPECT_GE(target.t_solved, target.t_arrival);
    FingerTiming timing;
    ASSERT_TRUE(bench.edges.finger_timings.pop(timing));
    EXPECT_LE(timing.t_taken, timing.t_solved);
  }
  bench.edges.stop = true;
  EXPECT_EQ(thread.join(), 0U) << "heap uses";
  EXPECT_EQ(bench.edges.counters.finger_skipped, 0U);
}

TEST(FingerLoop, ReportsWhatBecameOfEachMarkerAndCountsItOverAllFrames) {
  FingerBench bench;
  test::WatchedThread thread(bench.edges.stop, [&] { bench.loop.run(); });
  constexpr std::size_t kFrames = 30;
  std::array<std::uint32_t, kMaxMarkers> seen{};
  for (std::size_t k = 0; k < kFrames; ++k) {
    const MarkerFrame frame = bench.motion.frame(k).markers;
    for (std::size_t slot = 0; slot < frame.count; ++slot) seen[slot] += frame.markers[slot].visible ? 1 : 0;
    bench.publish(k);
    ASSERT_TRUE(eventually([&] { return bench.used() == k + 1; })) << "frame " << k;
  }
  bench.edges.stop = true;
  EXPECT_EQ(thread.join(), 0U) << "heap uses";
  ASSERT_TRUE(bench.edges.fingers_to_telemetry.update());
  const FingerReport& report = bench.edges.fingers_to_telemetry.get();
  EXPECT_EQ(report.tally.frames, kFrames);
  EXPECT_EQ(report.tally.seen, seen);
  EXPECT_EQ(report.tracked.frame.frame_number, report.state.frame_number);
  for (const hand::FingerMarker& marker : bench.models.glove.finger_markers) {
    std::uint32_t all = 0;
    for (const std::uint32_t n : report.tally.verdicts[marker.slot]) all += n;
    EXPECT_EQ(all, kFrames) << "each frame has one verdict";
    EXPECT_EQ(report.tally.verdicts[marker.slot][static_cast<std::size_t>(hand::MarkerVerdict::kNone)], 0U);
  }
}

TEST(FingerLoop, SaysHowSureTheTargetIsAndTheBackOfTheHandCountsForAllOfIt) {
  FingerBench bench;
  test::WatchedThread thread(bench.edges.stop, [&] { bench.loop.run(); });
  const auto target_of = [&](bool checked, bool valid, double fit_error_m) {
    TrackedFrame tracked;
    tracked.frame = bench.motion.frame(bench.sequence).markers;
    tracked.pose = bench.models.hand_pose.step(tracked.frame);
    tracked.pose.valid = valid;
    tracked.pose.fit_error_m = fit_error_m;
    tracked.back.checked = checked;
    tracked.sequence = ++bench.sequence;
    bench.edges.frame_to_fingers.publish(tracked);
    bench.edges.fingers_wake.notify();
    EXPECT_TRUE(eventually([&] { return bench.used() == bench.sequence; }));
    bench.edges.target_to_hand.update();
    return bench.edges.target_to_hand.get();
  };
  EXPECT_EQ(target_of(true, true, 0.0).hand_confidence, 1.0);
  EXPECT_LT(target_of(true, true, 0.004).hand_confidence, 0.5);
  EXPECT_EQ(target_of(true, false, 0.0).hand_confidence, 0.0);
  EXPECT_LT(target_of(false, true, 0.01).hand_confidence, 0.1) << "the same for a sensor without back markers";
  EXPECT_EQ(target_of(false, false, 0.0).hand_confidence, 0.0);
  const FingerTarget good = target_of(true, true, 0.0);
  for (std::size_t i = 0; i < good.joint_count; ++i) EXPECT_GT(good.joint_confidence[i], 0.3) << "joint " << i;
  bench.edges.stop = true;
  EXPECT_EQ(thread.join(), 0U) << "heap uses";
}

TEST(FingerLoop, TakesTheNewestFrameAndCountsTheOnesItPassesOver) {
  FingerBench bench;
  test::WatchedThread thread(bench.edges.stop, [&] { bench.loop.run(); });
  bench.publish(0);
  EXPECT_TRUE(eventually([&] { return bench.used() == 1; }));  // skips count from the first frame on
  for (std::size_t k = 1; k < 500; ++k) bench.publish(k);
  EXPECT_TRUE(eventually([&] { return bench.used() + bench.edges.counters.finger_skipped == 500; }));
  bench.edges.stop = true;
  thread.join();
  bench.edges.target_to_hand.update();
  EXPECT_EQ(bench.edges.target_to_hand.get().frame_number, 500U) << "the newest frame is always used in the end";
}

TEST(FingerLoop, ComputesForHalfOfTheTimeAtMost) {
  FingerBench bench({milliseconds(20), true});
  const TimePoint start = now();
  test::WatchedThread thread(bench.edges.stop, [&] { bench.loop.run(); });
  for (std::size_t k = 0; now() - start < milliseconds(800); ++k) {
    bench.publish(k % bench.motion.frame_count());
    std::this_thread::yield();
  }
  const std::uint64_t used = bench.used();
  const Duration elapsed = now() - start;
  bench.edges.stop = true;
  thread.join();
  EXPECT_GT(used, 2U);
  // Half of each window of 100 ms, one frame that began before the half was over, and the window that has just begun.
  EXPECT_LE(used * milliseconds(20), elapsed / 2 + milliseconds(50 + 20 + 20));
}

TEST(FingerLoop, MarksTargetsOfAHandThatIsNotSeen) {
  FingerBench bench;
  test::WatchedThread thread(bench.edges.stop, [&] { bench.loop.run(); });
  TrackedFrame nothing;
  nothing.sequence = 1;
  bench.edges.frame_to_fingers.publish(nothing);
  bench.edges.fingers_wake.notify();
  EXPECT_TRUE(eventually([&] { return bench.used() == 1; }));
  bench.edges.stop = true;
  thread.join();
  bench.edges.target_to_hand.update();
  EXPECT_FALSE(bench.edges.target_to_hand.get().valid);
}

}  // namespace
}  // namespace embody
