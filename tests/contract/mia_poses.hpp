#pragma once
// Two poses of the Mia hand, as every line to it has them.
#include <algorithm>

#include "drivers/mia/mia_config.hpp"
#include "drivers/mia/transmission.hpp"
#include "tests/contract/hand_cell.hpp"

namespace embody::test {

inline constexpr int kMiaSpeed_percent = 15;  ///< 78 counts/s of the slowest motor

inline void set_mia_poses(HandCell& cell) {
  cell.near_rad = {0.2, 0.2, 0.2};
  cell.far_rad = {1.0, 1.1, 1.2};
  const auto units = [](const std::vector<double>& q) {
    const auto counts = mia::motor_counts(mia::Transmission{}, {q[0], q[1], q[2]});
    return std::vector<double>(counts.begin(), counts.end());
  };
  cell.near_units = units(cell.near_rad);
  cell.far_units = units(cell.far_rad);
  const auto& limits = mia::MiaConfig{}.max_rad;  // the compact profile has the same
  cell.most_units = units({limits.begin(), limits.end()});
  for (double& counts : cell.most_units) counts = std::min<double>(counts, mia::kMaxCounts);
}

}  // namespace embody::test
