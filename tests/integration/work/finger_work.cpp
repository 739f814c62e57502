// finger_work FRAMES: steps the finger estimator on random markers, the worst that can come, and prints how many
// iterations its five solvers used in all. Run under callgrind by finger_work_test.
#include <cstdio>
#include <cstdlib>

#include "core/hand/finger_estimator.hpp"
#include "tests/unit/math/random_values.hpp"

int main(int argc, char** argv) {
  using namespace embody;
  const int frames = argc > 1 ? std::atoi(argv[1]) : 0;
  test::RandomValues random(/*seed=*/7);
  hand::FingerEstimatorConfig config;
  config.trust_labels = true;  // nothing is too absurd to be fitted
  hand::FingerEstimator fingers(hand::HandModel{}, hand::paper_glove(), config);
  HandPose pose;
  pose.valid = true;
  HandState state;
  MarkerFrame frame;
  frame.count = 13;
  long iterations = 0;
  for (int k = 0; k < frames; ++k) {
    for (std::size_t slot = 3; slot < 13; ++slot) frame.markers[slot] = {random.vector<3>(-.2, .2), true};
    frame.t_capture += std::chrono::milliseconds(10);
    fingers.step(frame, pose, state);
    for (const int n : fingers.iterations()) iterations += n;
  }
  std::printf("iterations %ld cap %d\n", iterations, hand::FingerEstimatorConfig{}.max_iterations);
  return 0;
}
