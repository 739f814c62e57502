#include "core/hand/synthetic_motion.hpp"

#include <algorithm>
#include <cmath>

namespace embody::hand {
namespace {

using Angles = Eigen::Matrix<double, kHandAngles, 1>;
using Eigen::Vector3d;

constexpr double kCycleSeconds = 15.0;
constexpr double kNoiseMetres = 0.03e-3;  // standard deviation per axis
constexpr double kRingStepSeconds = 7.0;
constexpr std::array<double, 3> kRingStepMetres{-.0048, .0, -.0064};  // in M, 8 mm
constexpr std::size_t kSlots = 13, kThumbTip = 3, kRingTip = 9;

enum Grip : std::size_t { kRelaxed, kOpen, kClosed };

// Where the hand rests for an instant: wrist joint in W, orientation relative to the first one (rotation vector in W),
// fingers.
struct Key {
  double t_s;
  std::array<double, 3> p_W;
  std::array<double, 3> rotation_rad;
  Grip grip;
};

constexpr std::array<double, 3> kFirstRotation{-.3933, 2.4797, 1.8633};  // R_WM at t = 0
constexpr std::array<Key, 15> kKeys{{
    {0.0, {.069, .142, .426}, {.00, .00, .00}, kRelaxed},
    {1.0, {.069, .142, .426}, {.00, .00, .00}, kRelaxed},
    {2.3, {.252, .200, .290}, {-.30, .46, -.02}, kOpen},    // reach
    {3.0, {.265, .190, .250}, {-.34, .36, .00}, kOpen},     // go down
    {3.8, {.265, .190, .250}, {-.34, .36, .00}, kClosed},   // grasp
    {4.8, {.215, .150, .350}, {-.25, .25, .02}, kClosed},   // lift
    {6.2, {.240, .250, .360}, {-.20, .30, -.15}, kClosed},  // carry
    {7.6, {.150, .190, .390}, {-.15, .20, -.10}, kClosed},  // and back
    {9.0, {.255, .240, .300}, {-.23, .40, -.16}, kClosed},  // and to the place
    {9.8, {.262, .240, .255}, {-.23, .30, -.15}, kClosed},  // set down
    {10.3, {.262, .240, .255}, {-.23, .30, -.15}, kClosed},
    {11.1, {.262, .240, .255}, {-.23, .30, -.15}, kOpen},   // release
    {12.0, {.225, .220, .320}, {-.20, .35, -.10}, kOpen},   // rise
    {13.4, {.069, .142, .426}, {.00, .00, .00}, kRelaxed},  // return
    {kCycleSeconds, {.069, .142, .426}, {.00, .00, .00}, kRelaxed},
}};
constexpr double kClosedFromSeconds = 3.8, kClosedToSeconds = 10.3;

// Finger angles, rounded from a real hand in the same glove. Fingers: spread (y of the knuckle), then flexion (z) of
// knuckle, middle and end joint, from index to little finger. Thumb: all nine angles.
struct GripAngles {
  std::array<std::array<double, 4>, 4> fingers;
  std::array<double, 9> thumb;
};
constexpr std::array<GripAngles, 3> kGrips{{
    {{{{-.15, -.45, .45, .45}, {-.35, -.15, .35, .45}, {-.40, .00, .60, .00}, {-.40, .75, .05, .00}}},
     {-.05, .15, -.05, .15, -.05, .05, .05, .00, .00}},
    {{{{-.15, -.52, .30, .35}, {-.35, -.22, .25, .40}, {-.40, -.05, .50, .00}, {-.40, .65, .00, .00}}},
     {.00, .20, -.10, .15, -.05, .00, .00, .00, .00}},
    {{{{.00, -.15, 1.00, .60}, {-.10, .45, .80, .20}, {-.05, .80, .40, .10}, {.00, 1.00, .30, .30}}},
     {.20, .10, .45, -.05, .10, .05, -.10, .00, .00}},
}};

Vector3d vector(const std::array<double, 3>& v) noexcept {
  return {v[0], v[1], v[2]};
}

Angles grip_angles(Grip grip) noexcept {
  const GripAngles& given = kGrips[grip];
  Angles q = Angles::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    const auto first = static_cast<Eigen::Index>(kFingerOffset[i + 1]);
    q(first + 1) = given.fingers[i][0];
    for (Eigen::Index joint = 0; joint < 3; ++joint) {
      q(first + 3 * joint + 2) = given.fingers[i][static_cast<std::size_t>(joint) + 1];
    }
  }
  for (std::size_t i = 0; i < 9; ++i) q(static_cast<Eigen::Index>(kFingerOffset[0] + i)) = given.thumb[i];
  return q;
}

struct Posture {
  Vector3d p_W_wrist;
  Eigen::Matrix3d R_WM;
  Angles q_rad;
};

Posture posture_at(double t_s) noexcept {
  std::size_t i = 1;
  while (i + 1 < kKeys.size() && kKeys[i].t_s < t_s) ++i;
  const Key& a = kKeys[i - 1];
  const Key& b = kKeys[i];
  const double u = std::clamp((t_s - a.t_s) / (b.t_s - a.t_s), 0.0, 1.0);
  const double s = u * u * u * (10.0 + u * (-15.0 + 6.0 * u));  // minimum jerk (Flash & Hogan 1985)
  const Eigen::Matrix3d R_a = math::exp_so3(vector(a.rotation_rad));
  const Eigen::Matrix3d R_b = math::exp_so3(vector(b.rotation_rad));
  Posture at;
  at.p_W_wrist = vector(a.p_W) + s * (vector(b.p_W) - vector(a.p_W));
  at.R_WM = R_a * math::exp_so3(s * math::log_so3(R_a.transpose() * R_b)) * math::exp_so3(vector(kFirstRotation));
  at.q_rad = grip_angles(a.grip) + s * (grip_angles(b.grip) - grip_angles(a.grip));
  return at;
}

// Random numbers as a function of a seed and two counters (the output function of splitmix64, Steele et al. 2014).
std::uint64_t random_bits(std::uint64_t seed, std::uint64_t a, std::uint64_t b) noexcept {
  std::uint64_t z = seed;
  for (const std::uint64_t word : {a, b}) {
    z += 0x9e3779b97f4a7c15ULL * (word + 1);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    z ^= z >> 31;
  }
  return z;
}

// Uniform in (0, 1).
double uniform(std::uint64_t seed, std::uint64_t a, std::uint64_t b) noexcept {
  return (static_cast<double>(random_bits(seed, a, b) >> 11) + 0.5) * 0x1p-53;
}

// Standard normal (Box & Muller 1958).
double normal(std::uint64_t seed, std::uint64_t a, std::uint64_t b) noexcept {
  constexpr double kTwoPi = 6.28318530717958647693;
  return std::sqrt(-2.0 * std::log(uniform(seed, a, 2 * b))) * std::cos(kTwoPi * uniform(seed, a, 2 * b + 1));
}

// Independent streams of one seed.
constexpr std::uint64_t kGapStream = 1ULL << 62, kDropStream = 2ULL << 62;

// Top, left, right marker in H: edges 55.2 (top-left), 44.7 (top-right) and 32.4 mm (left-right).
std::array<Vector3d, 3> triad() noexcept {
  constexpr double kTopLeft = .0552, kTopRight = .0447, kLeftRight = .0324;
  const double z = (kTopRight * kTopRight + kLeftRight * kLeftRight - kTopLeft * kTopLeft) / (2.0 * kTopRight);
  return {Vector3d(0.0, 0.0, kTopRight), Vector3d(std::sqrt(kLeftRight * kLeftRight - z * z), 0.0, z),
          Vector3d(0.0, 0.0, 0.0)};
}

}  // namespace

SyntheticMotion::SyntheticMotion(const SyntheticMotionConfig& config, const HandModel& model, const Pose& X_HM) noexcept
    : config_(config), model_(model), X_MH_(X_HM.inverse()) {
  constexpr double kMostSeconds = 1e6, kMostHertz = 1e4;  // also refuses what is not a number
  if (config.rate_hz > 0.0 && config.rate_hz <= kMostHertz && config.duration_s > 0.0 &&
      config.duration_s <= kMostSeconds) {
    frame_count_ = static_cast<std::size_t>(std::llround(config.duration_s * config.rate_hz));
  }
}

SyntheticFrame SyntheticMotion::frame(std::size_t k) const noexcept {
  const double t_s = static_cast<double>(k) / config_.rate_hz;
  const Posture posture = posture_at(std::fmod(t_s, kCycleSeconds));
  SyntheticFrame out;
  out.q_rad = posture.q_rad;
  out.X_WM.linear() = posture.R_WM;
  out.X_WM.translation() = posture.p_W_wrist - posture.R_WM * model_.rest_joints()[0];
  out.X_WH = out.X_WM * X_MH_;

  MarkerFrame& markers = out.markers;
  markers.frame_number = k + 1;
  markers.t_capture = TimePoint{from_seconds(static_cast<double>(k + 1) / config_.rate_hz)};
  markers.t_arrival = markers.t_capture;
  markers.count = kSlots;
  const std::array<Vector3d, 3> p_H = triad();
  for (std::size_t i = 0; i < 3; ++i) markers.markers[i].p_W = out.X_WH * p_H[i];
  for (std::size_t f = 0; f < kFingers; ++f) {
    const Vector9 q = out.q_rad.segment<9>(static_cast<Eigen::Index>(kFingerOffset[f]));
    const std::array<Vector3d, 2> p_M = model_.finger_points(static_cast<Finger>(f), q);
    for (std::size_t point = 0; point < 2; ++point) markers.markers[3 + 2 * f + point].p_W = out.X_WM * p_M[point];
  }
  if (t_s >= kRingStepSeconds) markers.markers[kRingTip].p_W += posture.R_WM * vector(kRingStepMetres);
  for (std::size_t slot = 0; slot < kSlots; ++slot) {
    Marker& marker = markers.markers[slot];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      marker.p_W(static_cast<Eigen::Index>(axis)) += kNoiseMetres * normal(config_.seed, k, 3 * slot + axis);
    }
    marker.visible = !dropped(slot, k);
  }
  return out;
}

bool SyntheticMotion::dropped(std::size_t slot, std::size_t k) const noexcept {
  if (slot < kThumbTip) return false;
  const double t_s = static_cast<double>(k) / config_.rate_hz;
  if (slot == kThumbTip) {  // one gap in each of the windows into which the closed phase falls
    constexpr std::uint64_t kWindows = 2;
    constexpr double kWindowSeconds = (kClosedToSeconds - kClosedFromSeconds) / kWindows;
    const double since_closed_s = std::fmod(t_s, kCycleSeconds) - kClosedFromSeconds;
    if (since_closed_s < 0.0 || since_closed_s >= kWindowSeconds * kWindows) return false;
    const auto window = static_cast<std::uint64_t>(since_closed_s / kWindowSeconds);
    const std::uint64_t id = kWindows * static_cast<std::uint64_t>(t_s / kCycleSeconds) + window;
    const double length_s = 0.16 + 0.41 * uniform(config_.seed, kGapStream, 2 * id);
    const double start_s = 0.3 + 0.8 * uniform(config_.seed, kGapStream, 2 * id + 1);
    const double in_window_s = since_closed_s - kWindowSeconds * static_cast<double>(window);
    return in_window_s >= start_s && in_window_s < start_s + length_s;
  }
  // One drop-out of one of the other finger markers in each 64 frames.
  constexpr std::size_t kWindow = 64, kLongest = 5, kOthers = kSlots - kThumbTip - 1;
  const std::uint64_t bits = random_bits(config_.seed, kDropStream, k / kWindow);
  const std::size_t start = (bits >> 16) % (kWindow - kLongest);
  const std::size_t length = 1 + (bits >> 32) % kLongest;
  return slot == kThumbTip + 1 + bits % kOthers && k % kWindow >= start && k % kWindow < start + length;
}

}  // namespace embody::hand
