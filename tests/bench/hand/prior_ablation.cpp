// What each part of the finger prior is worth, judged by markers that the fit does not see: calibrates on frames
// 1-1000 of a recording with the 13-marker glove, then fits thumb 2, index 2 and the tips of middle, ring and little
// finger only, and prints how far their middle markers are from the model in the other frames.
//   prior_ablation RECORDING.tsv
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "core/hand/calibration.hpp"
#include "core/hand/finger_estimator.hpp"
#include "core/hand/hand_pose_estimator.hpp"
#include "tests/unit/hand/real_recording.hpp"

namespace embody::hand {
namespace {

constexpr std::size_t kCalibrationFrames = 1000;
constexpr std::array<std::size_t, 3> kUnseen{8, 10, 12};

struct Trial {
  std::array<double, 3> unseen_mm{};
  double seen_mm{0.0};
  double step_max_deg{0.0};
};

Trial run(const std::vector<MarkerFrame>& frames, const HandModel& model, const CalibratedGlove& calibrated,
          const Pose& X_HM, const FingerEstimatorConfig& config) {
  GloveLayout glove = calibrated.glove;
  glove.finger_markers.clear();
  for (const FingerMarker& marker : calibrated.glove.finger_markers) {
    const bool unseen = std::find(kUnseen.begin(), kUnseen.end(), marker.slot) != kUnseen.end();
    if (!unseen) glove.finger_markers.push_back(marker);
  }
  HandPoseEstimator hand(glove, X_HM);
  FingerEstimator fingers(model, glove, config);
  HandState state, last;
  Trial trial;
  std::array<std::size_t, 3> judged{};
  std::size_t fitted = 0;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const HandPose pose = hand.step(frames[k]);
    fingers.step(frames[k], pose, state);
    if (k >= kCalibrationFrames) {
      for (const FingerMarker& marker : calibrated.glove.finger_markers) {
        if (!frames[k].markers[marker.slot].visible) continue;
        const auto offset = static_cast<Eigen::Index>(kFingerOffset[static_cast<std::size_t>(marker.finger)]);
        const FingerChain chain = model.chain(marker.finger, state.q_rad.segment<9>(offset));
        const double mm =
            1e3 *
            (pose.X_WM * model.point(marker.finger, marker.point, chain) - frames[k].markers[marker.slot].p_W).norm();
        const auto found = std::find(kUnseen.begin(), kUnseen.end(), marker.slot);
        if (found == kUnseen.end()) {
          trial.seen_mm += mm;
          ++fitted;
        } else {
          trial.unseen_mm[static_cast<std::size_t>(found - kUnseen.begin())] += mm;
          ++judged[static_cast<std::size_t>(found - kUnseen.begin())];
        }
      }
      for (Eigen::Index j = 0; j < 15; ++j) {
        const double step = math::angle_between(math::exp_so3(last.q_rad.segment<3>(3 * j)),
                                                math::exp_so3(state.q_rad.segment<3>(3 * j)));
        trial.step_max_deg = std::max(trial.step_max_deg, step * 57.29577951308232);
      }
    }
    last = state;
  }
  for (std::size_t i = 0; i < 3; ++i) trial.unseen_mm[i] /= static_cast<double>(judged[i]);
  trial.seen_mm /= static_cast<double>(fitted);
  return trial;
}

constexpr const char* kColumns = "middle   ring little | fit | step deg | middle   ring little | fit | step deg";

void print(const char* name, const Trial& calibrated, const Trial& manual) {
  std::printf("%-28s", name);
  for (const Trial* trial : {&calibrated, &manual}) {
    std::printf(" %6.2f %6.2f %6.2f  %5.2f  %7.1f  ", trial->unseen_mm[0], trial->unseen_mm[1], trial->unseen_mm[2],
                trial->seen_mm, trial->step_max_deg);
  }
  std::printf("\n");
}

int judge(const char* path) {
  auto frames = test::read_recording(path, paper_glove());
  if (frames.size() <= kCalibrationFrames) {
    std::fprintf(stderr, "%s: no recording of more than %zu frames with the 13 markers\n", path, kCalibrationFrames);
    return 1;
  }
  for (std::size_t k = 0; k < frames.size(); ++k) {
    frames[k].t_capture = TimePoint{std::chrono::milliseconds(10) * (k + 1)};
  }
  const HandData data = builtin_hand(Skeleton::kBoneLengths, Side::kRight);
  const HandPoints points = default_points(data);
  const auto calibration = calibrate({frames.begin(), frames.begin() + kCalibrationFrames}, paper_glove(), data, points,
                                     paper_calibration());
  if (!calibration) {
    std::fprintf(stderr, "%s\n", std::string(calibration.error().detail.view()).c_str());
    return 1;
  }
  const CalibratedGlove glove = apply(*calibration, paper_glove(), points);
  const HandModel model(data, calibration->shape, glove.points);
  const HandModel manual(data, Shape::Zero(), points);
  const auto compare = [&](const char* name, const FingerEstimatorConfig& config) {
    print(name, run(frames, model, glove, calibration->X_HM, config),
          run(frames, manual, {paper_glove(), points}, paper_calibration(), config));
  };
  std::printf("%-28s %s\n", "mm at markers that the fit", "  calibrated hand                     | hand of mean shape");
  std::printf("%-28s %s\n", "does not see", kColumns);
  compare("whole prior", {});
  FingerEstimatorConfig config;
  const FingerEstimatorConfig published = FingerEstimatorConfig::published();
  config.coupling_m_rad = 0.0;
  compare("without coupled flexion", config);
  config = {};
  config.lower_rad = published.lower_rad;
  config.upper_rad = published.upper_rad;
  compare("without anatomical bounds", config);
  config = {};
  config.weight_plus = published.weight_plus;
  config.weight_minus = published.weight_minus;
  compare("with the published weights", config);
  config = {};
  for (Vector9& weight : config.temporal_m_rad) weight.setZero();
  compare("without the temporal term", config);
  config = published;
  config.objective = FingerObjective::kPublished;
  compare("published problem, no prior", config);
  return 0;
}

}  // namespace
}  // namespace embody::hand

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: prior_ablation RECORDING.tsv\n");
    return 2;
  }
  return embody::hand::judge(argv[1]);
}
