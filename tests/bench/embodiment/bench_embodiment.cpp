// Cost of one embodiment mapping and of the arm's kinematics.
#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>

#include "core/embodiment/arm_target.hpp"
#include "core/embodiment/embodiment_mapping.hpp"
#include "core/robot/ur_kinematics.hpp"
#include "tests/unit/embodiment/mia_config.hpp"

namespace embody {
namespace {

EmbodimentMapping mia() {
  Result<EmbodimentMapping> mapping = EmbodimentMapping::create(test::mia_model(), test::mia_config());
  if (!mapping) {
    std::fprintf(stderr, "%s\n", mapping.error().detail.c_str());
    std::exit(1);
  }
  return std::move(*mapping);
}

void embodiment_step(benchmark::State& bench) {
  EmbodimentMapping mapping = mia();
  HandState state;
  state.valid = true;
  state.quality.fill(FingerQuality::kOptimal);
  const auto p_P = mapping.finger_points(std::array<double, 3>{0.3, 0.6, 0.9});
  for (std::size_t f = 0; f < kFingers; ++f) {
    for (std::size_t i = 0; i < 2; ++i) {
      state.p_M[f][i] = mapping.X_PM().inverse() * (p_P[f][i] + Eigen::Vector3d(0.01, -0.01, 0.02));
    }
  }
  FingerTarget target;
  for (auto _ : bench) {
    mapping.step(state, target);
    benchmark::DoNotOptimize(target);
  }
}
BENCHMARK(embodiment_step);

void hand_forward_kinematics(benchmark::State& bench) {
  const EmbodimentMapping mapping = mia();
  robot::HandKinematics::Workspace workspace;
  const std::array<double, 3> r{0.3, 0.6, 0.9};
  for (auto _ : bench) {
    mapping.kinematics().update(r, workspace);
    benchmark::DoNotOptimize(workspace);
  }
}
BENCHMARK(hand_forward_kinematics);

const Vector6 kJoints = (Vector6() << 0.3, -1.2, 1.8, -2.1, -1.4, 0.7).finished();

void ur_forward_kinematics(benchmark::State& bench) {
  Vector6 q = kJoints;
  for (auto _ : bench) {
    benchmark::DoNotOptimize(q);
    benchmark::DoNotOptimize(robot::forward_kinematics(q));
  }
}
BENCHMARK(ur_forward_kinematics);

void ur_solve_nearest(benchmark::State& bench) {
  Pose X_BE = robot::forward_kinematics(kJoints);
  for (auto _ : bench) {
    benchmark::DoNotOptimize(X_BE);
    benchmark::DoNotOptimize(robot::solve_nearest(X_BE, kJoints));
  }
}
BENCHMARK(ur_solve_nearest);

void ur_jacobian(benchmark::State& bench) {
  Vector6 q = kJoints;
  for (auto _ : bench) {
    benchmark::DoNotOptimize(q);
    benchmark::DoNotOptimize(robot::jacobian(q));
  }
}
BENCHMARK(ur_jacobian);

}  // namespace
}  // namespace embody

BENCHMARK_MAIN();
