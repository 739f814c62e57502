#include "core/embodiment/pad_samples.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "core/math/triangle_distance.hpp"

namespace embody {
namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;
constexpr std::size_t kOversampling = 5;
constexpr std::size_t kMostSamples = 10'000;
constexpr std::size_t kTriesPerSample = 100;
constexpr double kLeastSine = 0.1;  // between facing and axis
constexpr double kInside_m = 1e-7;  // this much below a pad's surface is inside

/// A pad's own right-handed frame: along its axis, out of the finger, across.
struct PadFrame {
  Vector3d along, out, across;
  double length_m{0.0};
};

struct Candidate {
  PadSample sample;
  Vector3d p_P;
};

/// Uniform numbers in [0, 1) that do not depend on the standard library.
class Uniform {
 public:
  explicit Uniform(std::uint64_t seed) : engine_(seed) {}
  double operator()() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

 private:
  std::mt19937_64 engine_;
};

bool is_round(const ContactPad& pad) {
  return pad.width_m == 0.0;
}

Result<PadFrame> pad_frame(const ContactPad& pad) noexcept {
  const auto bad = [&pad](const char* why) {
    return make_error(Errc::kInvalidArgument, "contact pad on link '%.60s': %s", pad.link.c_str(), why);
  };
  const Vector3d axis = pad.to_m - pad.from_m;
  if (!axis.allFinite() || !pad.facing.allFinite() || !std::isfinite(pad.radius_m) || !std::isfinite(pad.width_m)) {
    return bad("a number is not finite");
  }
  if (pad.radius_m < 0.0 || pad.width_m < 0.0) return bad("radius_m and width_m must not be negative");
  if (is_round(pad) && pad.radius_m == 0.0) return bad("a round pad needs a radius_m, a flat one a width_m");
  if (pad.facing.norm() < 1e-6) return bad("facing must not be zero");
  PadFrame frame;
  frame.length_m = axis.norm();
  const Vector3d facing = pad.facing.normalized();
  if (frame.length_m == 0.0) {
    if (!is_round(pad)) return bad("from_m and to_m of a flat pad must differ");
    frame.along = facing.unitOrthogonal();  // a hemisphere has no axis
  } else {
    frame.along = axis / frame.length_m;
  }
  const Vector3d out = facing - facing.dot(frame.along) * frame.along;
  if (out.norm() < kLeastSine) return bad("facing must point across the axis from from_m to to_m, not along it");
  frame.out = out.normalized();
  frame.across = frame.along.cross(frame.out);
  return frame;
}

double area_m2(const ContactPad& pad, const PadFrame& frame) {
  return is_round(pad) ? kPi * pad.radius_m * (frame.length_m + 2.0 * pad.radius_m) : frame.length_m * pad.width_m;
}

/// A point that is uniformly distributed on the pad. Both round ends together are a hemisphere, whose height over its
/// base is uniform (Archimedes).
PadSample draw(const ContactPad& pad, const PadFrame& frame, Uniform& uniform) {
  const double u = uniform(), v = uniform(), which = uniform();
  PadSample sample;
  if (!is_round(pad)) {
    sample.normal_L = frame.out;
    sample.p_L = pad.from_m + u * frame.length_m * frame.along + pad.radius_m * frame.out +
                 (v - 0.5) * pad.width_m * frame.across;
    return sample;
  }
  Vector3d centre = pad.from_m;
  if (which * (frame.length_m + 2.0 * pad.radius_m) < frame.length_m) {
    const double angle = kPi * (v - 0.5);
    sample.normal_L = std::cos(angle) * frame.out + std::sin(angle) * frame.across;
    centre += u * frame.length_m * frame.along;
  } else {
    const double angle = 2.0 * kPi * v, radius = std::sqrt(1.0 - u * u);
    const double along = radius * std::cos(angle);
    sample.normal_L = u * frame.out + along * frame.along + radius * std::sin(angle) * frame.across;
    if (along > 0.0) centre = pad.to_m;
  }
  sample.p_L = centre + pad.radius_m * sample.normal_L;
  return sample;
}

/// True when `p_P` is inside of a round pad other than its own.
bool is_hidden(const Vector3d& p_P, std::size_t own, std::span<const ContactPad> pads, std::span<const Pose> X_PL) {
  for (std::size_t i = 0; i < pads.size(); ++i) {
    if (i == own || !is_round(pads[i])) continue;
    const Vector3d p_L = X_PL[i].inverse() * p_P;
    const Vector3d on_axis = math::nearest_on_segment(p_L, pads[i].from_m, pads[i].to_m);
    if ((p_L - on_axis).norm() < pads[i].radius_m - kInside_m) return true;
  }
  return false;
}

/// Removes the most crowded candidate until `count` are left. Weights and constants of Yuksel 2015, section 3, for
/// surfaces: w_ij = (1 - d_ij / 2 r_max)^8 with d_ij at least 2 r_min. For some hundred candidates the plain quadratic
/// search is fast enough.
void eliminate(std::vector<Candidate>& candidates, std::size_t count, double area) {
  const std::size_t n = candidates.size();
  const double ratio = static_cast<double>(count) / static_cast<double>(n);
  const double r_max = std::sqrt(area / (2.0 * std::sqrt(3.0) * static_cast<double>(count)));
  const double r_min = r_max * (1.0 - std::pow(ratio, 1.5)) * 0.65;
  const auto crowding = [&](std::size_t i, std::size_t j) {
    const double distance = std::max(2.0 * r_min, (candidates[i].p_P - candidates[j].p_P).norm());
    return distance < 2.0 * r_max ? std::pow(1.0 - distance / (2.0 * r_max), 8) : 0.0;
  };
  std::vector<double> weights(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double w = crowding(i, j);
      weights[i] += w;
      weights[j] += w;
    }
  }
  constexpr double kRemoved = -1e300;
  for (std::size_t left = n; left > count; --left) {
    const auto worst = static_cast<std::size_t>(std::max_element(weights.begin(), weights.end()) - weights.begin());
    weights[worst] = kRemoved;
    for (std::size_t i = 0; i < n; ++i) weights[i] -= crowding(worst, i);
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (weights[i] > 0.5 * kRemoved) candidates[kept++] = candidates[i];
  }
  candidates.resize(kept);
}

}  // namespace

Result<double> pad_area_m2(const ContactPad& pad) noexcept {
  const Result<PadFrame> frame = pad_frame(pad);
  if (!frame) return frame.error();
  return area_m2(pad, *frame);
}

Result<std::vector<PadSample>> pad_samples(std::span<const ContactPad> pads, std::span<const Pose> X_PL,
                                           std::size_t count, std::uint64_t seed) {
  if (pads.empty() || pads.size() != X_PL.size() || count == 0 || count > kMostSamples) {
    return make_error(Errc::kInvalidArgument, "cannot place %zu samples on %zu pads with %zu poses", count, pads.size(),
                      X_PL.size());
  }
  std::vector<PadFrame> frames;
  std::vector<double> ends_m2;  // of each pad in the sum of the areas
  for (const ContactPad& pad : pads) {
    const Result<PadFrame> frame = pad_frame(pad);
    if (!frame) return frame.error();
    frames.push_back(*frame);
    ends_m2.push_back((ends_m2.empty() ? 0.0 : ends_m2.back()) + area_m2(pad, *frame));
  }

  Uniform uniform(seed);
  std::vector<Candidate> candidates;
  std::size_t tries = 0;
  for (; candidates.size() < kOversampling * count; ++tries) {
    if (tries >= kTriesPerSample * kOversampling * count) {
      return make_error(Errc::kInvalidArgument, "contact pads on link '%.60s' and others lie inside of each other",
                        pads.front().link.c_str());
    }
    const double at = uniform() * ends_m2.back();
    const auto above = std::upper_bound(ends_m2.begin(), ends_m2.end(), at);
    const auto pad = std::min(pads.size() - 1, static_cast<std::size_t>(above - ends_m2.begin()));
    Candidate candidate{draw(pads[pad], frames[pad], uniform), Vector3d::Zero()};
    candidate.sample.pad = pad;
    candidate.p_P = X_PL[pad] * candidate.sample.p_L;
    if (!is_hidden(candidate.p_P, pad, pads, X_PL)) candidates.push_back(candidate);
  }
  eliminate(candidates, count, ends_m2.back() * static_cast<double>(candidates.size()) / static_cast<double>(tries));
  std::vector<PadSample> samples;
  samples.reserve(candidates.size());
  for (const Candidate& candidate : candidates) samples.push_back(candidate.sample);
  return samples;
}

}  // namespace embody
