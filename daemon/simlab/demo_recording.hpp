#pragma once
// The recording that the project ships and `./demo` plays (config/recordings/demo.tsv).
#include <cstdint>

#include "drivers/recording/recording.hpp"

namespace embody::sim {

inline constexpr double kDemoDuration_s = 15.0;
inline constexpr std::uint64_t kDemoSeed = 1;

/// Reach, grasp, lift, place and return of a synthetic right hand with the noise and drop-outs of a real measurement.
[[nodiscard]] recording::Recording make_demo_recording(double duration_s = kDemoDuration_s,
                                                       std::uint64_t seed = kDemoSeed);

}  // namespace embody::sim
