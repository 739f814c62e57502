// What tracker faults do to the finger tips: error against the truth of a synthetic motion and against the fault-free
// run, over the share of faulty marker-frames, with and without the marker guard.
//   fault_curve [SECONDS]
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "core/hand/synthetic_motion.hpp"
#include "tests/unit/hand/guarded_hand.hpp"
#include "tests/unit/hand/marker_faults.hpp"

namespace embody::hand {
namespace {

struct Errors {
  std::vector<double> mm;

  [[nodiscard]] double mean() const {
    double sum = 0.0;
    for (const double error : mm) sum += error;
    return sum / static_cast<double>(mm.size());
  }
  [[nodiscard]] double percentile(double share) {
    const auto rank = std::min(mm.size() - 1, static_cast<std::size_t>(share * static_cast<double>(mm.size())));
    std::nth_element(mm.begin(), mm.begin() + static_cast<std::ptrdiff_t>(rank), mm.end());
    return mm[rank];
  }
};

struct Row {
  Errors from_truth, from_clean;
};

std::vector<HandState> run(const test::Frames& frames, bool guarded) {
  test::GuardedHand hand(guarded);
  std::vector<HandState> states;
  HandState state;
  for (const MarkerFrame& frame : frames) {
    hand.step(frame, state);
    states.push_back(state);
  }
  return states;
}

Row compare(const std::vector<HandState>& states, const std::vector<HandState>& clean, const SyntheticMotion& motion) {
  Row row;
  const HandModel model;
  for (std::size_t k = 20; k < states.size(); ++k) {
    const SyntheticFrame truth = motion.frame(k);
    for (std::size_t f = 0; f < kFingers; ++f) {
      const auto offset = static_cast<Eigen::Index>(kFingerOffset[f]);
      const auto p_M = model.finger_points(static_cast<Finger>(f), truth.q_rad.segment<9>(offset));
      row.from_truth.mm.push_back(1e3 * (states[k].p_M[f][0] - p_M[0]).norm());
      row.from_clean.mm.push_back(1e3 * (states[k].p_M[f][0] - clean[k].p_M[f][0]).norm());
    }
  }
  return row;
}

void print_curve(const char* name, test::FaultKind kind, std::size_t longest, double seconds) {
  const test::Frames clean = test::synthetic_frames(seconds);
  const SyntheticMotion motion({100.0, seconds, 1});
  const std::vector<HandState> reference = run(clean, true);
  std::printf("\n%s, runs of 1 to %zu frames\n", name, longest);
  std::printf(
      "  faulty | guard: truth mean  p99  max | clean mean  p99  max | none:  truth mean   max | clean max (mm)\n");
  for (const double rate : {0.0, .01, .02, .05, .1, .15, .2}) {
    test::Frames faulty = clean;
    const double share = test::make_faults(faulty, kind, rate, longest, /*seed=*/131);
    Row with = compare(run(faulty, true), reference, motion);
    Row without = compare(run(faulty, false), reference, motion);
    std::printf("  %5.1f %% |       %6.2f %6.2f %6.1f | %6.2f %6.2f %6.1f |       %6.2f %6.1f | %6.1f\n", 1e2 * share,
                with.from_truth.mean(), with.from_truth.percentile(.99), with.from_truth.percentile(1.0),
                with.from_clean.mean(), with.from_clean.percentile(.99), with.from_clean.percentile(1.0),
                without.from_truth.mean(), without.from_truth.percentile(1.0), without.from_clean.percentile(1.0));
  }
}

}  // namespace
}  // namespace embody::hand

int main(int argc, char** argv) {
  using embody::test::FaultKind;
  const double seconds = argc > 1 ? std::atof(argv[1]) : 15.0;
  if (!(seconds >= 2.0 && seconds <= 600.0)) {
    std::fprintf(stderr, "usage: fault_curve [SECONDS], 2 to 600\n");
    return 1;
  }
  for (const std::size_t longest : {9, 30}) {
    embody::hand::print_curve("drop-outs", FaultKind::kDropOut, longest, seconds);
    embody::hand::print_curve("swaps", FaultKind::kSwap, longest, seconds);
    embody::hand::print_curve("ghosts", FaultKind::kGhost, longest, seconds);
    embody::hand::print_curve("all three", FaultKind::kAll, longest, seconds);
  }
  return 0;
}
