// Cost and accuracy of the record mapping, frame by frame, on a real recording (without it: on the synthetic one).
// Times of one step are reported as median, 99th percentile and maximum in microseconds; residuals in millimetres.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include "core/hand/finger_estimator.hpp"
#include "core/hand/hand_pose_estimator.hpp"
#include "core/hand/synthetic_motion.hpp"
#include "tests/unit/hand/real_recording.hpp"

namespace embody::hand {
namespace {

const std::vector<MarkerFrame>& recording() {
  static const std::vector<MarkerFrame> kFrames = [] {
    auto frames = test::read_recording(EMBODY_SOURCE_DIR "/../shared/data/small_pillow.tsv", paper_glove());
    const SyntheticMotion motion({100.0, 30.0, 1});
    for (std::size_t k = 0; frames.size() < 1500 && k < motion.frame_count(); ++k) {
      frames.push_back(motion.frame(k).markers);
    }
    return frames;
  }();
  return kFrames;
}

template <class T>
double quantile(std::vector<T>& values, double q) {
  const auto at = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return static_cast<double>(values[static_cast<std::size_t>(at)]);
}

template <class Step>
double timed_us(const Step& step) {
  const auto start = std::chrono::steady_clock::now();
  step();
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
}

void report_times(benchmark::State& state, std::vector<double>& us) {
  state.counters["us_median"] = quantile(us, 0.5);
  state.counters["us_p99"] = quantile(us, 0.99);
  state.counters["us_max"] = quantile(us, 1.0);
}

void hand_pose(benchmark::State& state) {
  std::vector<double> us;
  HandPoseEstimator estimator(paper_glove(), paper_calibration());
  HandPose pose;
  for (auto _ : state) {
    for (const MarkerFrame& frame : recording()) us.push_back(timed_us([&] { pose = estimator.step(frame); }));
  }
  benchmark::DoNotOptimize(pose);
  report_times(state, us);
}
BENCHMARK(hand_pose)->Unit(benchmark::kMillisecond)->Iterations(3);

void five_fingers(benchmark::State& state) {
  const HandData data = builtin_hand(state.range(0) == 0 ? Skeleton::kBoneLengths : Skeleton::kWebXr, Side::kRight);
  const HandModel model(data, Shape::Zero(), default_points(data));
  std::vector<double> us;
  std::array<double, kFingers> residual_mm{};
  std::array<std::size_t, kFingers> solved{};
  std::array<std::vector<int>, kFingers> iterations;
  std::size_t capped = 0, all = 0;
  for (auto _ : state) {
    HandPoseEstimator hand(paper_glove(), paper_calibration());
    FingerEstimator fingers(model, paper_glove(), {});
    HandState hand_state;
    for (const MarkerFrame& frame : recording()) {
      const HandPose pose = hand.step(frame);
      us.push_back(timed_us([&] { fingers.step(frame, pose, hand_state); }));
      for (std::size_t f = 0; f < kFingers; ++f) {
        if (hand_state.quality[f] == FingerQuality::kHeld) continue;
        residual_mm[f] += 1e3 * hand_state.residual_m[f];
        iterations[f].push_back(fingers.iterations()[f]);
        capped += hand_state.quality[f] == FingerQuality::kCapped;
        ++solved[f];
        ++all;
      }
    }
  }
  report_times(state, us);
  state.counters["capped_percent"] = 100.0 * static_cast<double>(capped) / static_cast<double>(all);
  for (std::size_t f = 0; f < kFingers; ++f) {
    const std::string name = kFingerNames[f];
    state.counters[name + "_mm"] = residual_mm[f] / static_cast<double>(solved[f]);
    state.counters[name + "_iter_p50"] = quantile(iterations[f], 0.5);
    state.counters[name + "_iter_p99"] = quantile(iterations[f], 0.99);
    state.counters[name + "_iter_max"] = quantile(iterations[f], 1.0);
  }
}
BENCHMARK(five_fingers)->ArgName("skeleton")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond)->Iterations(3);

}  // namespace
}  // namespace embody::hand

BENCHMARK_MAIN();
