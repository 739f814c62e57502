// What smoothing of finger angles gains and costs (docs/filtering.md). Three tables:
// 1. jitter of the joints in held postures under white noise of the markers, over the filter's lag at rest;
// 2. noise on a moving hand: distance to the noise-free angles over the delay, for no filter, a plain exponential
// filter
//    and this one, on a real recording (without it: on the synthetic one);
// 3. lag of the suggested filter at constant joint speeds.
// Not timed; runs some seconds. An argument sets the noise in millimetres per axis (1).
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <random>
#include <vector>

#include "core/hand/finger_estimator.hpp"
#include "core/hand/hand_pose_estimator.hpp"
#include "core/hand/hand_state_filter.hpp"
#include "core/hand/synthetic_motion.hpp"
#include "tests/unit/hand/real_recording.hpp"

namespace embody::hand {
namespace {

using std::chrono::milliseconds;
using Angles = Eigen::Matrix<double, static_cast<int>(kHandAngles), 1>;

constexpr double kDegrees = 180.0 / 3.14159265358979323846;
constexpr std::size_t kHandJoints = kHandAngles / 3;
constexpr unsigned kSeed = 7;
enum class Noisy { kNone, kFingers, kAll };

Eigen::Matrix3d rotation(const Angles& q_rad, std::size_t joint) {
  return math::exp_so3(q_rad.segment<3>(static_cast<Eigen::Index>(3 * joint)));
}

constexpr int kRestLag_ms = 400;  // the defaults of the daemon
constexpr int kMotionLag_ms = 10;
constexpr double kTarget_deg = 0.3;
constexpr std::size_t kSettled = 500;  // frames

using Filter = std::function<std::vector<HandState>(const std::vector<HandState>&)>;

HandStateFilterConfig filter_config(int rest_ms, int motion_ms) {
  HandStateFilterConfig config;
  config.lag_at_rest = milliseconds(rest_ms);
  config.lag_in_motion = milliseconds(motion_ms);
  return config;
}

/// Estimates of all frames at 100 Hz with white noise on the markers.
std::vector<HandState> estimate(const std::vector<MarkerFrame>& frames, Noisy noisy, double noise_m) {
  std::mt19937 random(kSeed);
  std::normal_distribution<double> normal(0.0, noise_m);
  HandPoseEstimator hand(paper_glove(), paper_calibration());
  FingerEstimator fingers(HandModel{}, paper_glove(), {});
  std::vector<HandState> states(1);
  for (const MarkerFrame& clean : frames) {
    MarkerFrame frame = clean;
    frame.t_capture = frame.t_arrival = TimePoint{milliseconds(10 * static_cast<int>(states.size()))};
    for (std::size_t slot = 0; slot < frame.count; ++slot) {
      const Eigen::Vector3d offset(normal(random), normal(random), normal(random));
      if (noisy == Noisy::kAll || (noisy == Noisy::kFingers && slot > 2)) frame.markers[slot].p_W += offset;
    }
    fingers.step(frame, hand.step(frame), states.back());
    states.push_back(states.back());
  }
  states.pop_back();
  return states;
}

std::vector<HandState> filtered(std::vector<HandState> states, const HandStateFilterConfig& config) {
  HandStateFilter filter(HandModel{}, config);
  for (HandState& state : states) filter.step(state);
  return states;
}

std::vector<HandState> smoothed(std::vector<HandState> states, double alpha) {
  for (std::size_t k = 1; k < states.size(); ++k) {
    states[k].q_rad = alpha * states[k].q_rad + (1.0 - alpha) * states[k - 1].q_rad;
  }
  return states;
}

/// Jitter about the mean orientation of each joint.
struct Jitter {
  double square_sum{0.0};
  std::size_t count{0};
  double worst_joint_deg{0.0};
  double worst_step_deg{0.0};

  void add(const std::vector<HandState>& states, std::size_t from) {
    for (std::size_t joint = 0; joint < kHandJoints; ++joint) {
      Angles mean = Angles::Zero();
      for (std::size_t k = from; k < states.size(); ++k) mean += states[k].q_rad;
      mean /= static_cast<double>(states.size() - from);
      const Eigen::Matrix3d R_mean = rotation(mean, joint);
      double sum = 0.0;
      for (std::size_t k = from; k < states.size(); ++k) {
        const Eigen::Matrix3d R = rotation(states[k].q_rad, joint);
        const double angle_deg = kDegrees * math::angle_between(R_mean, R);
        sum += angle_deg * angle_deg;
        const double step_deg = kDegrees * math::angle_between(rotation(states[k - 1].q_rad, joint), R);
        worst_step_deg = std::max(worst_step_deg, step_deg);
      }
      worst_joint_deg = std::max(worst_joint_deg, std::sqrt(sum / static_cast<double>(states.size() - from)));
      square_sum += sum;
      count += states.size() - from;
    }
  }
  [[nodiscard]] double rms_deg() const { return std::sqrt(square_sum / static_cast<double>(count)); }
};

/// Postures of the synthetic motion: open, reaching, half and fully closed, opening again; each held for 15 s.
std::vector<std::vector<MarkerFrame>> held_postures() {
  std::vector<std::vector<MarkerFrame>> postures;
  const SyntheticMotion motion;
  for (const std::size_t k : {10U, 200U, 320U, 360U, 430U, 560U, 650U, 1150U}) {
    MarkerFrame markers = motion.frame(k).markers;
    for (std::size_t slot = 0; slot < markers.count; ++slot) markers.markers[slot].visible = true;
    postures.emplace_back(1500, markers);
  }
  return postures;
}

using Held = std::vector<std::vector<HandState>>;

Held estimate_held(Noisy noisy, double noise_m) {
  Held held;
  for (const auto& posture : held_postures()) held.push_back(estimate(posture, noisy, noise_m));
  return held;
}

Jitter jitter_of(const Held& held, const Filter& filter) {
  Jitter jitter;
  for (const auto& posture : held) jitter.add(filter(posture), kSettled);
  return jitter;
}

void print_held(const Held& fingers_noisy, const Held& all_noisy, double noise_mm) {
  std::printf("1. Held postures, white noise of %.2f mm per axis, 100 Hz: angle of a joint about its mean, degrees\n",
              noise_mm);
  std::printf("   RMS over all joints and postures, RMS of the worst joint, largest step of a joint in one frame\n");
  std::printf("%14s | %-26s | %-26s\n", "", "finger markers noisy", "all 13 markers noisy");
  std::printf("%14s | %8s %8s %8s | %8s %8s %8s\n", "lag at rest ms", "RMS", "worst", "step", "RMS", "worst", "step");
  int enough_ms = -1;
  for (const int lag_ms : {0, 20, 50, 100, 150, 200, 250, 300, 350, 400, 500, 600, 800, 1200}) {
    const Filter filter = [&](const auto& states) {
      return filtered(states, filter_config(lag_ms, std::min(lag_ms, kMotionLag_ms)));
    };
    const Jitter a = jitter_of(fingers_noisy, filter);
    const Jitter b = jitter_of(all_noisy, filter);
    if (enough_ms < 0 && a.rms_deg() <= kTarget_deg) enough_ms = lag_ms;
    std::printf("%14d | %8.3f %8.3f %8.3f | %8.3f %8.3f %8.3f\n", lag_ms, a.rms_deg(), a.worst_joint_deg,
                a.worst_step_deg, b.rms_deg(), b.worst_joint_deg, b.worst_step_deg);
  }
  if (enough_ms >= 0) {
    std::printf("   %.1f degrees RMS with noisy finger markers cost %d ms at rest and %d ms in motion.\n", kTarget_deg,
                enough_ms, enough_ms == 0 ? 0 : kMotionLag_ms);
  } else {
    std::printf("   %.1f degrees RMS with noisy finger markers are not reached.\n", kTarget_deg);
  }
  // Noise of the back of the hand looks like a motion of all fingers: it needs a higher threshold as well.
  for (const double motion_rad_s : {0.6, 1.0, 2.0, 4.0}) {
    for (const int lag_ms : {400, 800, 1200, 1600, 2000}) {
      HandStateFilterConfig config = filter_config(lag_ms, kMotionLag_ms);
      config.motion_rad_s = motion_rad_s;
      const Jitter jitter = jitter_of(all_noisy, [&](const auto& states) { return filtered(states, config); });
      if (jitter.rms_deg() > kTarget_deg) continue;
      std::printf("   %.1f degrees RMS with 13 noisy markers cost %d ms at rest, with motion_rad_s = %.1f.\n",
                  kTarget_deg, lag_ms, motion_rad_s);
      return;
    }
  }
  std::printf("   %.1f degrees RMS with 13 noisy markers are not reached within 2 s.\n", kTarget_deg);
}

std::vector<MarkerFrame> moving_hand() {
  auto frames = test::read_recording(EMBODY_SOURCE_DIR "/../shared/data/small_pillow.tsv", paper_glove());
  const SyntheticMotion motion({100.0, 30.0, 1});
  for (std::size_t k = 0; frames.size() < 1500 && k < motion.frame_count(); ++k) {
    frames.push_back(motion.frame(k).markers);
  }
  return frames;
}

struct AngleError {
  double rms_deg{0.0};
  double p99_deg{0.0};
};

/// Angles of all joints between `states` and the `reference` `shift_ms` earlier.
AngleError error_of(const std::vector<HandState>& states, const std::vector<HandState>& reference, double shift_ms) {
  std::vector<double> angles_deg;
  double sum = 0.0;
  const auto back = static_cast<std::size_t>(shift_ms / 10.0);
  const double s = shift_ms / 10.0 - static_cast<double>(back);
  for (std::size_t k = 200; k < states.size(); ++k) {
    const Angles q = (1.0 - s) * reference[k - back].q_rad + s * reference[k - back - 1].q_rad;
    for (std::size_t joint = 0; joint < kHandJoints; ++joint) {
      angles_deg.push_back(kDegrees * math::angle_between(rotation(q, joint), rotation(states[k].q_rad, joint)));
      sum += angles_deg.back() * angles_deg.back();
    }
  }
  const auto p99 = angles_deg.begin() + static_cast<std::ptrdiff_t>(angles_deg.size() * 99 / 100);
  std::nth_element(angles_deg.begin(), p99, angles_deg.end());
  return {std::sqrt(sum / static_cast<double>(angles_deg.size())), *p99};
}

void print_moving(const Held& held, double noise_mm) {
  const std::vector<MarkerFrame> frames = moving_hand();
  const std::vector<HandState> clean = estimate(frames, Noisy::kNone, 0.0);
  const std::vector<HandState> noisy = estimate(frames, Noisy::kFingers, 1e-3 * noise_mm);
  std::printf("\n2. Moving hand (%zu frames), noise on the finger markers, against the noise-free angles, degrees\n",
              frames.size());
  std::printf(
      "   lag error: angle over all joints without noise, what the filter costs; delay: the shift that makes its\n"
      "   RMS least; noisy: RMS with noise; held: RMS jitter in held postures\n");
  std::printf("%-38s %9s %9s %9s %9s %9s\n", "", "lag error", "its p99", "delay ms", "noisy", "held");
  const auto row = [&](const char* name, const Filter& filter) {
    const std::vector<HandState> states = filter(clean);
    const AngleError lag = error_of(states, clean, 0.0);
    double best_ms = 0.0, best_deg = lag.rms_deg;
    for (double ms = 2.0; ms <= 300.0; ms += 2.0) {
      const double deg = error_of(states, clean, ms).rms_deg;
      if (deg >= best_deg) break;
      best_ms = ms;
      best_deg = deg;
    }
    std::printf("%-38s %9.2f %9.2f %9.0f %9.2f %9.2f\n", name, lag.rms_deg, lag.p99_deg, best_ms,
                error_of(filter(noisy), clean, 0.0).rms_deg, jitter_of(held, filter).rms_deg());
  };
  row("none", [](const auto& states) { return states; });
  row("exponential, alpha 0.2 (40 ms)", [](const auto& states) { return smoothed(states, 0.2); });
  row("exponential, alpha 0.025 (390 ms)", [](const auto& states) { return smoothed(states, 0.025); });
  for (const int rest : {50, 100, 200, kRestLag_ms}) {
    for (const int motion : {kMotionLag_ms, 30}) {
      char name[64];
      std::snprintf(name, sizeof name, "adaptive, %d ms at rest, %d in motion", rest, motion);
      row(name, [&](const auto& states) { return filtered(states, filter_config(rest, motion)); });
    }
  }
}

/// Delay of a joint that turns at constant speed, as the filter states it.
void print_speeds() {
  std::printf(
      "\n3. Default filter (%d ms at rest, %d in motion): lag over the speed of the fastest joint of a finger\n",
      kRestLag_ms, kMotionLag_ms);
  for (const double speed_rad_s : {0.0, 0.1, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 1.0}) {
    HandStateFilter filter(HandModel{}, filter_config(kRestLag_ms, kMotionLag_ms));
    for (int k = 0; k < 300; ++k) {
      HandState state;
      state.valid = true;
      state.t_capture = TimePoint{milliseconds(10 * (k + 1))};
      state.q_rad(2) = -1.0 + 0.01 * k * speed_rad_s;
      filter.step(state);
    }
    const double lag_s = to_seconds(filter.lag()[static_cast<std::size_t>(Finger::kIndex)]);
    std::printf("   %4.2f rad/s: %5.1f ms, %4.2f degrees behind\n", speed_rad_s, 1e3 * lag_s,
                kDegrees * speed_rad_s * lag_s);
  }
}

}  // namespace
}  // namespace embody::hand

int main(int argc, char** argv) {
  using namespace embody::hand;
  const double noise_mm = argc > 1 ? std::atof(argv[1]) : 1.0;
  const Held fingers_noisy = estimate_held(Noisy::kFingers, 1e-3 * noise_mm);
  const Held all_noisy = estimate_held(Noisy::kAll, 1e-3 * noise_mm);
  print_held(fingers_noisy, all_noisy, noise_mm);
  print_moving(fingers_noisy, noise_mm);
  print_speeds();
}
