// finger_work FRAMES guarded|trusted: steps the finger estimator and prints how many evaluations its solvers used in
// all: one per iteration and one per solve. trusted: random markers, the worst that can come, every one fitted.
// guarded: the synthetic motion with a label that jumps about, as shipped. Run under callgrind by finger_work_test.
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "core/hand/finger_estimator.hpp"
#include "core/hand/hand_pose_estimator.hpp"
#include "core/hand/synthetic_motion.hpp"
#include "tests/unit/math/random_values.hpp"

int main(int argc, char** argv) {
  using namespace embody;
  const int frames = argc > 1 ? std::atoi(argv[1]) : 0;
  const bool guarded = argc > 2 && std::string_view(argv[2]) == "guarded";
  test::RandomValues random(/*seed=*/7);
  hand::FingerEstimatorConfig config;
  config.trust_labels = !guarded;
  hand::FingerEstimator fingers(hand::HandModel{}, hand::paper_glove(), config);
  hand::HandPoseEstimator hand(hand::paper_glove(), hand::paper_calibration());
  const hand::SyntheticMotion motion;
  HandPose pose;
  pose.valid = true;
  HandState state;
  MarkerFrame frame;
  frame.count = 13;
  long evaluations = 0;
  for (int k = 0; k < frames; ++k) {
    if (guarded) {
      frame = motion.frame(static_cast<std::size_t>(k)).markers;
      frame.markers[5].p_W += random.vector<3>(-.05, .05);
      pose = hand.step(frame);
    } else {
      for (std::size_t slot = 3; slot < 13; ++slot) frame.markers[slot] = {random.vector<3>(-.2, .2), true};
      frame.t_capture += std::chrono::milliseconds(10);
    }
    fingers.step(frame, pose, state);
    for (const int n : fingers.iterations()) evaluations += n + 1;
    if (fingers.unfold_iterations() > 0) evaluations += fingers.unfold_iterations() + 1;
  }
  std::printf("evaluations %ld cap %d\n", evaluations, config.max_iterations);
  return 0;
}
