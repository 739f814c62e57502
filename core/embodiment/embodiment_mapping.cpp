#include "core/embodiment/embodiment_mapping.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/embodiment/segments.hpp"

namespace embody {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr Duration kUsualStep = std::chrono::milliseconds(10);
constexpr std::size_t kScanned = 2;  // groups of so few motors start from a scan, others from the last frame
constexpr Duration kLongGap = std::chrono::milliseconds(100);  // after which the last posture is no good start alone
/// A finger of many joints has minima that end. It then goes on to the next one at this speed, 15 degrees in 10 ms:
/// slower would be smoother, but off the minimum in more frames (docs/robot_hands.md has the figures).
constexpr double kFastest_rad_s = 26.0;
constexpr std::size_t kThumb = 0;

/// Half the thickness of human finger tips, m: thumb, others.
constexpr double kThumbRadius = 0.0095, kFingerRadius = 0.0075;

double human_gap(const HandState& state, std::size_t finger) noexcept {
  const auto& thumb = state.distal_M[kThumb];
  const auto& other = state.distal_M[finger];
  const NearestPoints near = nearest_points(thumb[0], thumb[1], other[0], other[1]);
  return (near.on_b - near.on_a).norm() - kThumbRadius - kFingerRadius;
}

bool finite(const HandState& state, FingerSet follows) noexcept {
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!follows[f]) continue;
    if (!state.p_M[f][0].allFinite() || !state.p_M[f][1].allFinite()) return false;
    if (!state.distal_M[f][0].allFinite() || !state.distal_M[f][1].allFinite()) return false;
  }
  return true;
}

}  // namespace

StaticVector<MotorRange, kMaxHandJoints> HandGroup::within_reach() const noexcept {
  StaticVector<MotorRange, kMaxHandJoints> nearby;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const double from = start(static_cast<Index>(i));
    nearby.push_back(ranges[i].within(from - reach_rad, from + reach_rad));
  }
  return nearby;
}

/// Which fingers are followed, and how sure each motor is.
FingerSet EmbodimentMapping::rate(const HandState& state, FingerTarget& target) const noexcept {
  FingerSet follows;
  for (std::size_t f = 0; f < kFingers; ++f) {
    follows[f] = chains_[f].has_value() && state.quality[f] != FingerQuality::kNone;
  }
  target.joint_confidence.fill(1.0);  // of a motor that moves no finger
  for (std::size_t m = 0; m < ranges_.size(); ++m) {
    if (moves_[m].none()) continue;
    if ((moves_[m] & follows).none()) target.joint_confidence[m] = 0.0;
    for (std::size_t f = 0; f < kFingers; ++f) {
      if (!moves_[m][f] || !follows[f]) continue;
      const double confidence = std::isfinite(state.confidence[f]) ? state.confidence[f] : 0.0;
      target.joint_confidence[m] = std::min(target.joint_confidence[m], confidence);
    }
  }
  return follows;
}

void EmbodimentMapping::set_goal(const HandState& state, FingerSet follows) noexcept {
  goal_.last_rad = last_rad_;
  goal_.pinch_weight.fill(0.0);
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!follows[f]) continue;
    for (std::size_t i = 0; i < 2; ++i) goal_.points_P[f][i] = X_PM_ * state.p_M[f][i];
    goal_.directions_P[f] = X_PM_.linear() * (state.distal_M[f][1] - state.distal_M[f][0]).normalized();
    if (f == kThumb || !follows[kThumb] || !(config_.pinch_m > 0.0)) continue;
    if (state.distal_M[kThumb][0] == state.distal_M[kThumb][1] || state.distal_M[f][0] == state.distal_M[f][1])
      continue;
    constexpr double kFullWeight = 100.0;  // a tenth of a millimetre of gap costs as much as a centimetre of a point
    const double gap_m = human_gap(state, f);
    const double near = std::clamp(1.0 - gap_m / config_.pinch_m, 0.0, 1.0);
    goal_.pinch_gap_m[f] = std::max(gap_m, 0.0);
    goal_.pinch_weight[f] = kFullWeight * near * near;
  }
}

/// Fingers that share motors or a pinch, together.
void EmbodimentMapping::find_groups(FingerSet follows) noexcept {
  groups_.clear();
  FingerSet left = follows;
  for (std::size_t first = 0; first < kFingers; ++first) {
    if (!left[first]) continue;
    FingerSet fingers;
    fingers.set(first);
    for (std::size_t before = 0; before != fingers.count();) {
      before = fingers.count();
      for (std::size_t m = 0; m < ranges_.size(); ++m) {
        if ((moves_[m] & fingers).any()) fingers |= moves_[m] & follows;
      }
      for (std::size_t f = 1; f < kFingers; ++f) {
        if (goal_.pinch_weight[f] > 0.0 && (fingers[f] || fingers[kThumb])) fingers.set(f).set(kThumb);
      }
    }
    left &= ~fingers;
    HandGroup group;
    group.fingers = fingers;
    groups_.push_back(group);
  }
}

/// Motors whose angle the points hardly tell stay where they were (option temporal_m_rad).
void EmbodimentMapping::keep_still(HandGroup& group, HandProblem& problem) noexcept {
  goal_.stay_m_rad.fill(0.0);
  if (!(config_.temporal_m_rad > 0.0) || !known_) return;
  constexpr double kWellTold = 0.02;  // m/rad: motion of the points per angle that tells it well
  HandProblem::Model model;
  problem.evaluate(group.start, model);
  const double per_step = std::sqrt(to_seconds(kUsualStep) / to_seconds(dt_));
  for (Index i = 0; i < problem.size(); ++i) {
    const double told = model.gauss_newton(i, i) / (kWellTold * kWellTold);
    goal_.stay_m_rad[problem.motors()[static_cast<std::size_t>(i)]] =
        per_step * config_.temporal_m_rad / std::sqrt(1.0 + told);
  }
}

void EmbodimentMapping::solve(HandGroup& group) noexcept {
  HandProblem problem(chains_, goal_, weights_, group.fingers);
  group.ranges.clear();
  group.start.resize(problem.size());
  for (Index i = 0; i < problem.size(); ++i) {
    const std::size_t motor = problem.motors()[static_cast<std::size_t>(i)];
    group.ranges.push_back(ranges_[motor]);
    group.start(i) = last_rad_[motor];
  }
  keep_still(group, problem);
  const auto thumb = std::find(problem.motors().begin(), problem.motors().end(), thumb_motor_);
  if (config_.thumb_mode == ThumbMode::kAutomatic && thumb != problem.motors().end()) {
    solve_branches(group, problem);
  } else {
    solve_within(group, problem);
  }
  if (!group.solution.valid) return;
  for (Index i = 0; i < problem.size(); ++i) {
    last_rad_[problem.motors()[static_cast<std::size_t>(i)]] = group.solution.x(i);
  }
}

void EmbodimentMapping::solve_within(HandGroup& group, HandProblem& problem) const noexcept {
  const std::span<const MotorRange> ranges{group.ranges.begin(), group.ranges.size()};
  if (known_ && ranges.size() > kScanned && dt_ <= kLongGap) {
    group.reach_rad = group.fingers.count() == 1 ? kFastest_rad_s * to_seconds(dt_) : kAnywhere;
    const StaticVector<MotorRange, kMaxHandJoints> nearby = group.within_reach();
    group.solution = solve_own(problem, {nearby.begin(), nearby.size()}, group.start, options_);
    return;
  }
  if (known_) group.solution = solve_own(problem, ranges, group.start, options_);
  constexpr double kClearlyBetter = 0.9;  // of the cost: two minima of about the same cost must not alternate
  HandProblem::Variables start = group.start;
  const HandSolution found = solve_everywhere(problem, ranges, start, options_);
  if (group.solution.valid && !(found.cost_m2 < kClearlyBetter * group.solution.cost_m2)) return;
  group.solution = found;
  group.start = start;
}

/// Both halves of the thumb motor's range: the other one is entered when it has fitted clearly better for a while and
/// the last change is some time ago, for it means driving the index finger through full extension. Where the halves
/// meet nothing leaps, and the better one is taken.
void EmbodimentMapping::solve_branches(HandGroup& group, const HandProblem& whole) noexcept {
  constexpr double kClearlyBetter = 0.7;                         // of the cost,
  constexpr double kFarOff_m2 = 0.01 * 0.01;                     // and by this much: a point a centimetre off
  constexpr double kMeet = 0.1;                                  // rad
  constexpr Duration kLasting = std::chrono::milliseconds(200);  // noise is not better for so long without a break
  constexpr Duration kDwell = std::chrono::milliseconds(1000);
  std::array<HandGroup, 2> branches{group, group};  // opposed, lateral
  for (std::size_t b = 0; b < 2; ++b) {
    HandProblem problem = whole;
    HandGroup& branch = branches[b];
    for (std::size_t i = 0; i < problem.motors().size(); ++i) {
      if (problem.motors()[i] != thumb_motor_) continue;
      const MotorRange& range = ranges_[thumb_motor_];
      branch.ranges[i] = b == 0 ? range.within(0.0, range.upper_rad) : range.within(range.lower_rad, 0.0);
    }
    solve_within(branch, problem);
  }
  const double here_m2 = branches[lateral_ ? 1 : 0].solution.cost_m2;
  const double there_m2 = branches[lateral_ ? 0 : 1].solution.cost_m2;
  const bool better = there_m2 < kClearlyBetter * here_m2 && there_m2 < here_m2 - kFarOff_m2;
  double apart_rad = 0.0;
  for (std::size_t i = 0; i < whole.motors().size(); ++i) {
    if (whole.motors()[i] != thumb_motor_) continue;
    const auto k = static_cast<Index>(i);
    apart_rad = std::abs(branches[0].solution.x(k) - branches[1].solution.x(k));
  }
  const bool free = !known_ || apart_rad < kMeet;
  if (t_judged_ != t_last_) better_for_ = better ? better_for_ + dt_ : Duration{0};  // once per frame
  t_judged_ = t_last_;
  if (free ? there_m2 < here_m2 : better_for_ > kLasting && on_branch_ > kDwell) {
    lateral_ = !lateral_;
    on_branch_ = better_for_ = Duration{0};
  }
  group = branches[lateral_ ? 1 : 0];
}

/// Fingers whose tips are nearer than the margin, pinches left out.
FingerSet EmbodimentMapping::too_near() const noexcept {
  FingerSet near;
  for (std::size_t a = 0; a < kFingers; ++a) {
    for (std::size_t b = a + 1; b < kFingers; ++b) {
      if (a == kThumb && goal_.pinch_weight[b] > 0.0) continue;
      const double gap_m = pad_gap_m(static_cast<Finger>(a), static_cast<Finger>(b), last_rad_);
      if (gap_m < weights_.collision_m) near.set(a).set(b);
    }
  }
  return near;
}

/// Solves fingers whose tips came too near once more, together; and again when that pushed one into another (option
/// collision_margin_m).
void EmbodimentMapping::separate() noexcept {
  if (!(weights_.collision_m > 0.0)) return;
  FingerSet solved;
  for (std::size_t pass = 0; pass < kFingers; ++pass) {
    const FingerSet near = too_near() | solved;
    StaticVector<HandGroup, kFingers> apart;
    HandGroup together;
    for (const HandGroup& group : groups_) {
      if ((group.fingers & near).any()) {
        together.fingers |= group.fingers;
      } else {
        apart.push_back(group);
      }
    }
    if (together.fingers == solved) return;
    solved = together.fingers;
    solve(together);
    apart.push_back(together);
    groups_ = apart;
  }
}

void EmbodimentMapping::step(const HandState& state, FingerTarget& target) noexcept {
  target.frame_number = state.frame_number;
  target.t_capture = state.t_capture;
  target.t_arrival = state.t_arrival;
  target.joint_count = ranges_.size();
  target.residual_m.fill(0.0);
  const FingerSet follows = rate(state, target);
  target.valid = state.valid && finite(state, follows);
  if (target.valid) {
    constexpr Duration kShortest = std::chrono::milliseconds(1), kLongest = std::chrono::seconds(1);
    const bool running = known_ && state.t_capture > t_last_;  // a clock that stands still tells no time
    dt_ = running ? std::clamp(state.t_capture - t_last_, kShortest, kLongest) : kUsualStep;
    t_last_ = state.t_capture;
    on_branch_ = std::min<Duration>(on_branch_ + dt_, std::chrono::hours(1));
    set_goal(state, follows);
    find_groups(follows);
    for (HandGroup& group : groups_) solve(group);
    separate();
    target.valid = std::all_of(groups_.begin(), groups_.end(), [](const auto& group) { return group.solution.valid; });
    known_ = known_ || follows.any();
  }
  std::copy_n(last_rad_.begin(), ranges_.size(), target.q_rad.begin());
  if (!target.valid) return;
  const auto g_P = finger_points(last_rad_);
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!follows[f]) continue;
    const double sum_m2 =
        (goal_.points_P[f][0] - g_P[f][0]).squaredNorm() + (goal_.points_P[f][1] - g_P[f][1]).squaredNorm();
    target.residual_m[f] = std::sqrt(sum_m2 / 2.0);
  }
}

HandJointAngles EmbodimentMapping::urdf_joint_angles(std::span<const double> r_rad) const noexcept {
  std::array<double, robot::kMaxHandLinks> all{};
  kinematics_.joint_angles(r_rad, all);
  HandJointAngles angles;
  angles.count = urdf_joints_.size();
  for (std::size_t i = 0; i < angles.count; ++i) angles.q_rad[i] = all[urdf_joints_[i]];
  return angles;
}

std::array<std::array<Vector3d, 2>, kFingers> EmbodimentMapping::finger_points(
    std::span<const double> r_rad) const noexcept {
  std::array<std::array<Vector3d, 2>, kFingers> p_P;
  RobotFinger::Posture posture;
  for (std::size_t f = 0; f < kFingers; ++f) {
    p_P[f].fill(Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
    if (!chains_[f]) continue;
    chains_[f]->update(r_rad, r_rad, posture);
    p_P[f] = {chains_[f]->position(chains_[f]->tip(), posture), chains_[f]->position(chains_[f]->middle(), posture)};
  }
  return p_P;
}

double EmbodimentMapping::pad_gap_m(Finger a, Finger b, std::span<const double> r_rad) const noexcept {
  std::array<std::array<Vector3d, 2>, 2> axis;
  double radii_m = 0.0;
  RobotFinger::Posture posture;
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& chain = chains_[static_cast<std::size_t>(i == 0 ? a : b)];
    if (!chain || !chain->has_pad()) return std::numeric_limits<double>::quiet_NaN();
    chain->update(r_rad, r_rad, posture);
    axis[i] = {chain->position(chain->pad_from(), posture), chain->position(chain->pad_to(), posture)};
    radii_m += chain->pad_radius_m();
  }
  const NearestPoints near = nearest_points(axis[0][0], axis[0][1], axis[1][0], axis[1][1]);
  return (near.on_b - near.on_a).norm() - radii_m;
}

}  // namespace embody
