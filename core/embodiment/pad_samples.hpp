#pragma once
// Evenly spread points on the contact pads of a robot finger: where the similarity metric measures.
#include <span>
#include <vector>

#include "core/base/result.hpp"
#include "core/embodiment/embodiment_config.hpp"

namespace embody {

inline constexpr std::size_t kPadSamples = 100;  ///< per finger, as in the paper (section IV-E)

struct PadSample {
  std::size_t pad{0};                       ///< of the finger
  Eigen::Vector3d p_L{0.0, 0.0, 0.0};       ///< in the frame of the pad's link, m
  Eigen::Vector3d normal_L{0.0, 0.0, 0.0};  ///< unit length, out of the finger
};

/// Surface of one pad, m^2. Round: half of the cylinder and of both its round ends, pi r (l + 2 r); flat: l w.
/// Errors: kInvalidArgument (no surface, not finite, or `facing` along the axis).
[[nodiscard]] Result<double> pad_area_m2(const ContactPad& pad) noexcept;

/// `count` points on the surface of all pads of one finger together, by area, spread like a Poisson disk: five times as
/// many are drawn uniformly, then the most crowded one is removed until `count` are left (weighted sample elimination,
/// Yuksel 2015). What lies inside of another round pad is no surface: the ends of neighbouring phalanges overlap.
/// `X_PL`: pose of the link of each pad in one common frame, in a posture in which the finger is straight, by pad.
/// The same arguments give the same points on every machine up to rounding. Some 4 ms; allocates.
/// Errors: kInvalidArgument (a pad as above, no pads, count 0 or above 10000, or pads that hide each other).
[[nodiscard]] Result<std::vector<PadSample>> pad_samples(std::span<const ContactPad> pads, std::span<const Pose> X_PL,
                                                         std::size_t count = kPadSamples, std::uint64_t seed = 1);

}  // namespace embody
