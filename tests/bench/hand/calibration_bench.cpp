// How well the calibration finds a made-up hand in a made-up glove, over many trials, and what it does to a real
// recording.
//   calibration_bench [TRIALS] [FIRST_SEED]
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

#include "core/hand/calibration.hpp"
#include "core/hand/finger_estimator.hpp"
#include "core/hand/hand_pose_estimator.hpp"
#include "tests/unit/hand/free_motion.hpp"
#include "tests/unit/hand/real_recording.hpp"

namespace embody::hand {
namespace {

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

void print_row(const char* name, const std::vector<double>& values, double unit, double limit) {
  const auto within = std::count_if(values.begin(), values.end(), [limit](double v) { return v <= limit; });
  std::printf("  %-32s %6.2f %6.2f %6.2f %6.2f   within %.1f: %5.1f %%\n", name, unit * percentile(values, .5),
              unit * percentile(values, .9), unit * percentile(values, .95), unit * percentile(values, 1.0),
              unit * limit, 100.0 * static_cast<double>(within) / static_cast<double>(values.size()));
}

void print_trials(const char* name, std::size_t trials, std::uint64_t first_seed,
                  const test::FreeMotionConfig& config) {
  const HandData data = builtin_hand(Skeleton::kBoneLengths, Side::kRight);
  const HandPoints points = default_points(data);
  const CalibrationPrior prior;
  test::CalibrationErrors errors;
  std::vector<double> seconds;
  for (std::size_t trial = 0; trial < trials; ++trial) {
    const test::FreeMotion truth =
        test::free_motion(data, paper_glove(), points, paper_calibration(), prior, config, first_seed + trial);
    const auto start = std::chrono::steady_clock::now();
    const auto found = calibrate(truth.frames, paper_glove(), data, points, paper_calibration());
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    if (!found) {
      std::printf("trial %zu: %s\n", trial, std::string(found.error().detail.view()).c_str());
      continue;
    }
    errors.add(data, truth, *found, prior);
  }
  std::printf("\n%s: %zu trials, seeds from %llu; %.1f s each (median)\n", name, trials,
              static_cast<unsigned long long>(first_seed), percentile(seconds, .5));
  std::printf("  %-32s    p50    p90    p95    max\n", "");
  print_row("knuckle to tip marker, %", errors.length, 100.0, 0.02);
  print_row("marker to its joint, mm", errors.distance_m, 1000.0, 0.0015);
  std::vector<double> tips, middles;
  for (std::size_t i = 0; i < errors.distance_m.size(); ++i) (i % 2 ? middles : tips).push_back(errors.distance_m[i]);
  print_row("  tip markers", tips, 1000.0, 0.0015);
  print_row("  middle markers", middles, 1000.0, 0.0015);
  std::printf("  truth within two stated standard deviations: %.1f %% of %zu numbers; %zu named prior-only\n",
              100.0 * static_cast<double>(errors.inside) / static_cast<double>(std::max<std::size_t>(errors.known, 1)),
              errors.known, errors.prior_only);
  for (const auto& [what, group] : errors.groups) {
    std::printf("    %-12s %5.1f %% of %zu, %zu prior-only\n", what.c_str(),
                100.0 * static_cast<double>(group.inside) / static_cast<double>(std::max<std::size_t>(group.known, 1)),
                group.known, group.prior_only);
  }
}

/// Mean distance of each slot's marker to the model in frames 1001 to 3000, fitting all markers or only the tips of
/// middle, ring and little finger.
void print_real(const char* name, const std::vector<MarkerFrame>& frames, const GloveLayout& worn,
                const HandModel& model, const Pose& X_HM, bool tips_only) {
  GloveLayout fitted = worn;
  fitted.finger_markers.clear();
  for (const FingerMarker& marker : worn.finger_markers) {
    const bool middle = marker.slot % 2 == 0;
    if (!(tips_only && middle && marker.finger >= Finger::kMiddle)) fitted.finger_markers.push_back(marker);
  }
  HandPoseEstimator hand(fitted, X_HM);
  FingerEstimator fingers(model, fitted, {});
  std::array<double, 13> sum_mm{};
  std::array<std::size_t, 13> count{};
  HandState state;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    MarkerFrame frame = frames[k];
    frame.t_capture = TimePoint{std::chrono::milliseconds(10) * (k + 1)};
    const HandPose pose = hand.step(frame);
    fingers.step(frame, pose, state);
    if (k < 1000 || !pose.valid) continue;
    for (const FingerMarker& marker : worn.finger_markers) {
      if (!frame.markers[marker.slot].visible) continue;
      const auto offset = static_cast<Eigen::Index>(kFingerOffset[static_cast<std::size_t>(marker.finger)]);
      const FingerChain chain = model.chain(marker.finger, state.q_rad.segment<9>(offset));
      sum_mm[marker.slot] +=
          1e3 * (pose.X_WM * model.point(marker.finger, marker.point, chain) - frame.markers[marker.slot].p_W).norm();
      ++count[marker.slot];
    }
  }
  std::printf("  %-26s", name);
  for (std::size_t slot = 3; slot < 13; slot += 2) {
    std::printf("  %5.2f /%5.2f", sum_mm[slot] / static_cast<double>(count[slot]),
                sum_mm[slot + 1] / static_cast<double>(count[slot + 1]));
  }
  std::printf("\n");
}

void print_real_recording() {
  const auto frames = test::read_recording(EMBODY_SOURCE_DIR "/../shared/data/small_pillow.tsv", paper_glove());
  if (frames.size() < 3000) {
    std::printf("\nthe real recording ../shared/data/small_pillow.tsv is not here\n");
    return;
  }
  const HandData data = builtin_hand(Skeleton::kBoneLengths, Side::kRight);
  const HandPoints points = default_points(data);
  const std::vector<MarkerFrame> first(frames.begin(), frames.begin() + 1000);
  const auto found = calibrate(first, paper_glove(), data, points, paper_calibration());
  if (!found) return;
  const CalibratedGlove glove = apply(*found, paper_glove(), points);
  const HandModel manual(data, Shape::Zero(), points), calibrated(data, found->shape, glove.points);
  std::printf("\nreal recording, calibrated on frames 1-1000, mean distance in frames 1001-3000, tip / middle, mm\n");
  std::printf("  %-26s", "");
  for (const char* finger : kFingerNames) std::printf("  %12s", finger);
  std::printf("\n");
  print_real("manual, all fitted", frames, paper_glove(), manual, paper_calibration(), false);
  print_real("calibrated, all fitted", frames, glove.glove, calibrated, found->X_HM, false);
  print_real("manual, three unseen", frames, paper_glove(), manual, paper_calibration(), true);
  print_real("calibrated, three unseen", frames, glove.glove, calibrated, found->X_HM, true);
  for (const std::string& advice : found->advice) std::printf("  advice: %s\n", advice.c_str());
}

}  // namespace
}  // namespace embody::hand

int main(int argc, char** argv) {
  const long trials = argc > 1 ? std::atol(argv[1]) : 200;
  const long first_seed = argc > 2 ? std::atol(argv[2]) : 20000;
  if (trials < 1 || trials > 100'000 || first_seed < 0) {
    std::fprintf(stderr, "usage: calibration_bench [TRIALS] [FIRST_SEED]\n");
    return 1;
  }
  embody::hand::print_real_recording();
  embody::hand::print_trials("noise 1 mm per axis on all markers, drop-outs, swaps", static_cast<std::size_t>(trials),
                             static_cast<std::uint64_t>(first_seed), {});
  return 0;
}
