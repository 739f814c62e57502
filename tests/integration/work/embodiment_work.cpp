// embodiment_work HAND.toml FRAMES motion|random: steps the embodiment mapping and prints for each step which group of
// fingers was followed (from 0; -1: all of them) and how many evaluations its solution took; before that, for each
// group, how many it can take. motion: the synthetic motion through the record mapping. random: goals anywhere within
// 0.2 m, the worst that can come, for one group after the other. Run under callgrind by embodiment_work_test.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "core/hand/hand_pose_estimator.hpp"
#include "core/hand/synthetic_motion.hpp"
#include "daemon/app/config_io.hpp"
#include "daemon/app/models.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody {
namespace {

/// Evaluations of the objective for one group in one frame, at most. A solve takes one more than the cap, which counts
/// every iteration and every crossing of a kink, in all pieces together; at a crossing each kinked motor is tried by
/// one evaluation more. A group of few motors, and any after a gap, is also solved once in each smooth piece of its
/// first kinked motor, which that solve does not leave.
std::size_t most_evaluations(const HandGroup& group) {
  const auto iterations = static_cast<std::size_t>(HandSolverOptions{}.max_iterations) + 1;
  std::size_t kinked = 0, pieces = 1;
  for (const MotorRange& range : group.ranges) {
    if (range.kinks_rad.empty()) continue;
    if (kinked == 0) pieces = range.kinks_rad.size() + 1;
    ++kinked;
  }
  const std::size_t everywhere = pieces * iterations * std::max<std::size_t>(kinked, 1);
  const std::size_t own = iterations * (1 + kinked);
  return own + everywhere;
}

void random_state(test::RandomValues& random, FingerSet fingers, HandState& state) {
  state.valid = true;
  state.t_capture += std::chrono::milliseconds(90);  // just no gap, and time to go anywhere
  state.confidence.fill(1.0);
  for (std::size_t f = 0; f < kFingers; ++f) {
    state.quality[f] = fingers[f] ? FingerQuality::kOptimal : FingerQuality::kNone;
    for (std::size_t i = 0; i < 2; ++i) {
      state.p_M[f][i] = random.vector<3>(-.2, .2);
      state.distal_M[f][i] = random.vector<3>(-.2, .2);
    }
  }
}

/// Callgrind writes its counts out before each call: every second time, they are those of one step.
[[gnu::noinline]] void embodiment_work_mark() {
  asm volatile("");
}

void step(EmbodimentMapping& mapping, const HandState& state, int followed) {
  FingerTarget target;
  embodiment_work_mark();
  mapping.step(state, target);
  embodiment_work_mark();
  int evaluations = 0;
  for (const HandGroup& group : mapping.groups()) evaluations += group.solution.iterations;
  std::printf("step %d %d\n", followed, evaluations);
}

void follow_motion(EmbodimentMapping mapping, int frames) {
  const hand::SyntheticMotion motion;
  hand::HandPoseEstimator hand(hand::paper_glove(), hand::paper_calibration());
  hand::FingerEstimator fingers(hand::HandModel{}, hand::paper_glove(), {});
  HandState state;
  for (int k = 0; k < frames; ++k) {
    const MarkerFrame frame = motion.frame(static_cast<std::size_t>(k)).markers;
    fingers.step(frame, hand.step(frame), state);
    step(mapping, state, -1);
  }
}

void follow_random(const EmbodimentMapping& mapping, int frames, const std::vector<FingerSet>& groups) {
  test::RandomValues random(/*seed=*/7);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    EmbodimentMapping one = mapping;
    HandState state;
    for (int k = 0; k < frames; ++k) {
      random_state(random, groups[g], state);
      step(one, state, static_cast<int>(g));
    }
  }
}

int run(const char* file, int frames, bool random) {
  const auto hand = config::load_hand(file);
  const auto mapping = hand ? make_embodiment(hand->embodiment) : Result<EmbodimentMapping>(hand.error());
  if (!mapping) {
    std::fprintf(stderr, "embodiment_work: %s\n", std::string(mapping.error().detail.view()).c_str());
    return 1;
  }
  test::RandomValues any(/*seed=*/1);
  HandState state;
  random_state(any, FingerSet().set(), state);
  EmbodimentMapping first = *mapping;
  step(first, state, -1);
  std::vector<FingerSet> groups;
  for (const HandGroup& group : first.groups()) {
    std::printf("group %zu motors %zu most %zu\n", groups.size(), group.ranges.size(), most_evaluations(group));
    groups.push_back(group.fingers);
  }
  if (random) {
    follow_random(*mapping, frames, groups);
  } else {
    follow_motion(*mapping, frames);
  }
  return 0;
}

}  // namespace
}  // namespace embody

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: embodiment_work HAND.toml FRAMES motion|random\n");
    return 2;
  }
  return embody::run(argv[1], std::atoi(argv[2]), std::string_view(argv[3]) == "random");
}
