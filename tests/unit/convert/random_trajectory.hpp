#pragma once
// Trajectories made of random numbers.
#include "daemon/convert/trajectory.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::test {

/// `count` rows at `rate_hz`, smooth enough that neighbours are less than half a turn apart; two joints, one a length.
inline convert::Trajectory random_trajectory(std::size_t count, double rate_hz, std::uint64_t seed) {
  RandomValues random(seed);
  convert::Trajectory trajectory;
  trajectory.source = "trial.tsv";
  trajectory.hand = "made up";
  trajectory.first_frame = 11;
  trajectory.last_frame = 10 + count;
  trajectory.rate_hz = rate_hz;
  trajectory.joints = {{"a_joint", false}, {"slider", true}};
  math::Pose X = math::pose_from(random.vector<3>(-1.0, 1.0), random.rotation(3.0));
  for (std::size_t i = 0; i < count; ++i) {
    convert::TrajectoryRow& row = trajectory.rows.emplace_back();
    row.time_s = static_cast<double>(10 + i) / rate_hz;
    convert::set_pose(row, X);
    row.valid = random(0.0, 1.0) < 0.8;
    trajectory.q.push_back(random(-2.0, 2.0));
    trajectory.q.push_back(random(-0.1, 0.1));
    X = X * math::pose_from(random.vector<3>(-0.01, 0.01), random.rotation(1.5));
  }
  convert::make_continuous(trajectory);
  return trajectory;
}

}  // namespace embody::test
