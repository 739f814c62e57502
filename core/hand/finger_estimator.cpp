#include "core/hand/finger_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace embody::hand {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr Index kMiddleFlexion = 5;  // about z of the finger's second joint
constexpr double kPi = 3.14159265358979323846;
constexpr Duration kUsualStep = std::chrono::milliseconds(10);
constexpr int kTrialIterations = 10;  // from the present posture; more would not change a verdict of centimetres
constexpr Duration kLongest = std::chrono::hours(1);
constexpr int kReferenceEvaluations = 2000;
constexpr double kReferenceTolerance = 1e-14;
constexpr Duration kLongestStep = std::chrono::milliseconds(100);  // in which fingers catch up

Vector9 angles(double x1, double y1, double z1, double x2, double y2, double z2, double x3, double y3, double z3) {
  Vector9 w;
  w << x1, y1, z1, x2, y2, z2, x3, y3, z3;
  return w;
}

/// The same ranges and weights for a left hand, whose rotations about y and z have the other sign.
void mirror(FingerEstimatorConfig& config) noexcept {
  for (std::size_t f = 0; f < kFingers; ++f) {
    for (Index i = 0; i < 9; ++i) {
      if (i % 3 == 0) continue;
      const double lower = config.lower_rad[f](i);
      config.lower_rad[f](i) = -config.upper_rad[f](i);
      config.upper_rad[f](i) = -lower;
      std::swap(config.weight_plus[f](i), config.weight_minus[f](i));
    }
  }
}

}  // namespace

FingerEstimatorConfig FingerEstimatorConfig::published() noexcept {
  FingerEstimatorConfig config;
  config.lower_rad.fill(Vector9::Constant(-0.4 * kPi));
  config.upper_rad.fill(Vector9::Constant(0.4 * kPi));
  const Vector9 thumb = angles(.01, .01, .01, .01, .01, .01, .01, .05, .05);
  const Vector9 plus = angles(.1, .001, .001, .1, .01, .001, .1, .01, .001);
  const Vector9 minus = angles(.1, .001, .001, .1, .05, .005, .1, .05, .005);
  config.weight_plus = {thumb, angles(.1, .001, .001, .1, .05, .001, .1, .05, .001), plus, plus, plus};
  config.weight_minus = {thumb, angles(.1, .001, .001, .1, .05, .5, .1, .05, .05), minus, minus, minus};
  config.temporal_m_rad.fill(Vector9::Zero());
  config.coupling_m_rad = 0.0;
  return config;
}

FingerEstimatorConfig::FingerEstimatorConfig() noexcept {
  // Active ranges of the joints plus some tolerance for what the model does not know (twist, frames that are a few
  // degrees off): knuckles -29..100 degrees flexion, +-34 spread; middle joints -6..115; end joints -9..92.
  lower_rad.fill(angles(-.3, -.6, -.5, -.15, -.15, -.1, -.15, -.15, -.15));
  upper_rad.fill(angles(.3, .6, 1.75, .15, .15, 2.0, .15, .15, 1.6));
  weight_plus.fill(angles(.05, .002, .001, .1, .05, .001, .1, .05, .001));
  weight_minus = weight_plus;
  // The thumb's joints do not turn about M's axes: wide bounds, even weights (Fabisch et al. 2022).
  lower_rad[0].setConstant(-0.4 * kPi);
  upper_rad[0].setConstant(0.4 * kPi);
  weight_plus[0] = weight_minus[0] = angles(.01, .01, .01, .01, .01, .01, .01, .05, .05);
  temporal_m_rad.fill(Vector9::Constant(.005));
  coupling_m_rad = .01;
}

FingerEstimator::FingerEstimator(const HandModel& model, const GloveLayout& glove,
                                 const FingerEstimatorConfig& config) noexcept
    : model_(model), glove_(glove), config_(config), guard_(model, glove, config.guard) {
  if (model_.side() == Side::kLeft) mirror(config_);
  for (std::size_t f = 0; f < kFingers; ++f) {
    FingerProblem& problem = problems_[f];
    problem.finger = static_cast<Finger>(f);
    problem.objective = config_.objective;
    problem.weight_plus = config_.weight_plus[f];
    problem.weight_minus = config_.weight_minus[f];
    problem.coupling_m_rad = f == 0 ? 0.0 : config_.coupling_m_rad;  // the thumb's last two joints are not coupled
    problem.coupling_ratio = config_.coupling_ratio;
    memory_[f].q_rad = Vector9::Zero().cwiseMax(config_.lower_rad[f]).cwiseMin(config_.upper_rad[f]);
    memory_[f].chain = model_.chain(problem.finger, memory_[f].q_rad);
  }
  for (const FingerMarker& marker : glove_.finger_markers) ++carried_[static_cast<std::size_t>(marker.finger)];
}

void FingerEstimator::step(const MarkerFrame& frame, const HandPose& hand_pose, HandState& state) noexcept {
  const Duration dt = step_time(frame.t_capture);
  state.frame_number = frame.frame_number;
  state.t_capture = frame.t_capture;
  state.t_arrival = frame.t_arrival;
  state.X_WM = hand_pose.X_WM;
  state.valid = hand_pose.valid;
  if (config_.trust_labels) {
    trust(frame, hand_pose);
  } else {
    guard_.step(frame, hand_pose, checked_);
  }
  gather(frame);
  unfold_iterations_ = 0;
  for (std::size_t f = 0; f < kFingers; ++f) {
    FingerProblem& problem = problems_[f];
    if (!hand_pose.valid) problem.markers.clear();
    state.visible_markers[f] = static_cast<std::uint8_t>(problem.markers.size());
    if (problem.markers.empty()) {
      hold(f, dt, state);
    } else {
      prepare(f, dt);
      solve(f, state);
      if (state.quality[f] == FingerQuality::kHeld) {  // not solvable
        problem.markers.clear();
        hold(f, dt, state);
      }
    }
  }
  if (hand_pose.valid) explain();
  if (hand_pose.valid && !config_.trust_labels && guard_.trial()) {
    answer(*guard_.trial());
  } else {  // at most one solve besides the five
    unfold();
  }
  rate(hand_pose, state);
}

/// Time since the last frame; clocks may stand or run backwards.
Duration FingerEstimator::step_time(TimePoint t_capture) noexcept {
  const bool running = t_last_ != TimePoint{} && t_capture > t_last_;
  const Duration dt = running ? t_capture - t_last_ : kUsualStep;
  t_last_ = t_capture;
  return dt;
}

/// Every visible marker is what its label says.
void FingerEstimator::trust(const MarkerFrame& frame, const HandPose& hand_pose) noexcept {
  const Pose X_MW = hand_pose.X_WM.inverse();
  checked_.residual_m.fill(0.0);
  for (const FingerMarker& marker : glove_.finger_markers) {
    if (marker.slot >= kMaxMarkers) continue;
    const Marker& seen = frame.markers[marker.slot];
    const bool used = hand_pose.valid && marker.slot < frame.count && seen.visible && seen.p_W.allFinite();
    checked_.verdict[marker.slot] = used ? MarkerVerdict::kUsed : MarkerVerdict::kMissing;
    checked_.source[marker.slot] = static_cast<std::uint8_t>(marker.slot);
    if (used) checked_.p_M[marker.slot] = X_MW * seen.p_W;
  }
}

/// The usable markers of each finger.
void FingerEstimator::gather(const MarkerFrame& frame) noexcept {
  for (FingerProblem& problem : problems_) problem.markers.clear();
  for (FingerMemory& memory : memory_) memory.seen_now = 0;
  for (const FingerMarker& marker : glove_.finger_markers) {
    if (marker.slot >= kMaxMarkers || marker.point >= model_.point_count(marker.finger)) continue;
    if (!checked_.usable(marker.slot)) continue;
    const double weight = frame.markers[checked_.source[marker.slot]].confidence;
    if (!(weight > 0.0 && weight >= config_.least_confidence)) continue;
    const auto f = static_cast<std::size_t>(marker.finger);
    problems_[f].markers.push_back({marker.point, checked_.p_M[marker.slot], weight});
    const std::uint64_t measurement = kMaxMarkers * marker.point + checked_.source[marker.slot];
    memory_[f].seen_now = (kMaxMarkers * kMaxFingerPoints + 1) * memory_[f].seen_now + measurement + 1;
  }
}

/// Range, start and prior of one finger's problem. Angles that no marker depends on keep their value. After a marker
/// came or went, the angles may only move so fast until the new optimum lies within one step: no jump.
void FingerEstimator::prepare(std::size_t finger, Duration dt) noexcept {
  FingerProblem& problem = problems_[finger];
  FingerMemory& memory = memory_[finger];
  problem.model = &model_;  // here: copies of this object hold their own model
  std::size_t moved = 0;
  for (const FingerMeasurement& marker : problem.markers) {
    moved = std::max(moved, model_.joints_moving(problem.finger, marker.point));
  }
  memory.catching_up = memory.known && (memory.catching_up || memory.seen_now != memory.seen);
  memory.seen = memory.seen_now;
  const Vector9& q = memory.q_rad;
  problem.lower_rad = config_.lower_rad[finger];
  problem.upper_rad = config_.upper_rad[finger];
  const auto n = 3 * static_cast<Index>(moved);
  problem.lower_rad.tail(9 - n) = problem.upper_rad.tail(9 - n) = q.tail(9 - n);
  const double reach = config_.catch_up_rad_s * to_seconds(std::min(dt, kLongestStep)) /
                       std::sqrt(3.0);  // per component of a rotation vector
  if (memory.catching_up) {
    problem.lower_rad = problem.lower_rad.cwiseMax((q.array() - reach).matrix()).cwiseMin(q);
    problem.upper_rad = problem.upper_rad.cwiseMin((q.array() + reach).matrix()).cwiseMax(q);
  }
  problem.q_previous_rad = q;
  problem.start_rad = q;
  if (memory.unfold_to_rad) {
    const double left = *memory.unfold_to_rad - q(kMiddleFlexion);
    problem.start_rad(kMiddleFlexion) += std::clamp(left, -reach, reach);
    problem.lower_rad(kMiddleFlexion) = problem.upper_rad(kMiddleFlexion) = problem.start_rad(kMiddleFlexion);
  }
  const double per_step =
      std::sqrt(to_seconds(kUsualStep) / to_seconds(dt));  // a random walk: variance grows with time
  problem.temporal_m_rad = memory.known ? Vector9(per_step * config_.temporal_m_rad[finger]) : Vector9::Zero();
}

void FingerEstimator::solve(std::size_t finger, HandState& state) noexcept {
  const FingerProblem& problem = problems_[finger];
  FingerMemory& memory = memory_[finger];
  const FingerSolution solution = config_.solver == FingerSolver::kOwn
                                      ? solve_own(problem, config_.max_iterations, config_.tolerance)
                                      : solve_slsqp(problem, kReferenceEvaluations, kReferenceTolerance);
  iterations_[finger] = solution.iterations;
  state.quality[finger] = FingerQuality::kHeld;
  if (solution.status == SolveStatus::kInvalid) return;
  // A bound of the problem is one of the joint's range, or how far it may move in this step.
  bool at_range = false, at_reach = false;
  for (Index i = 0; i < 9; ++i) {
    if (!(problem.lower_rad(i) < problem.upper_rad(i))) continue;
    for (const auto& [pressed, bound, range] :
         {std::tuple{solution.q_rad(i) <= problem.lower_rad(i), problem.lower_rad(i), config_.lower_rad[finger](i)},
          std::tuple{solution.q_rad(i) >= problem.upper_rad(i), problem.upper_rad(i), config_.upper_rad[finger](i)}}) {
      if (pressed) (std::abs(bound - range) > 1e-12 ? at_reach : at_range) = true;
    }
  }
  const bool led = memory.unfold_to_rad.has_value();
  if (led && std::abs(solution.q_rad(kMiddleFlexion) - *memory.unfold_to_rad) < 1e-9) memory.unfold_to_rad.reset();
  memory.catching_up = memory.catching_up && (at_reach || led);
  memory.q_rad = solution.q_rad;
  memory.known = true;
  memory.unseen = Duration{0};
  memory.chain = model_.chain(problem.finger, solution.q_rad);
  memory.cost_m2 = solution.cost_m2;
  double distance_m = 0.0;
  for (const FingerMeasurement& marker : problem.markers) {
    distance_m += (model_.point(problem.finger, marker.point, memory.chain) - marker.p_M).norm();
  }
  memory.residual_m = distance_m / static_cast<double>(problem.markers.size());
  state.q_rad.segment<9>(static_cast<Index>(kFingerOffset[finger])) = solution.q_rad;
  state.p_M[finger] = {model_.point(problem.finger, 0, memory.chain), model_.point(problem.finger, 1, memory.chain)};
  state.distal_M[finger] = model_.distal(problem.finger, memory.chain);
  state.residual_m[finger] = memory.residual_m;
  state.quality[finger] = solution.status == SolveStatus::kCapped ? FingerQuality::kCapped
                          : at_range                              ? FingerQuality::kAtLimit
                                                                  : FingerQuality::kOptimal;
}

/// Tells the guard where the model has each marker now, and answers its question.
void FingerEstimator::explain() noexcept {
  for (const FingerMarker& marker : glove_.finger_markers) {
    if (marker.slot >= kMaxMarkers || marker.point >= model_.point_count(marker.finger)) continue;
    const FingerChain& chain = memory_[static_cast<std::size_t>(marker.finger)].chain;
    const Vector3d model_M = model_.point(marker.finger, marker.point, chain);
    if (!config_.trust_labels) {
      guard_.explain(marker.slot, model_M, checked_);
    } else if (checked_.usable(marker.slot)) {
      checked_.residual_m[marker.slot] = (model_M - checked_.p_M[marker.slot]).norm();
    }
  }
}

/// Would the finger explain the markers as the guard suspects them?
void FingerEstimator::answer(const MarkerTrial& trial) noexcept {
  FingerProblem problem = problems_[static_cast<std::size_t>(trial.finger)];
  problem.model = &model_;
  problem.lower_rad = config_.lower_rad[static_cast<std::size_t>(trial.finger)];
  problem.upper_rad = config_.upper_rad[static_cast<std::size_t>(trial.finger)];
  problem.start_rad = memory_[static_cast<std::size_t>(trial.finger)].q_rad;
  guard_.answer(
      posture_residual_m(problem, trial, std::min(config_.max_iterations, kTrialIterations), config_.tolerance));
}

/// The middle joint is straight or beyond.
bool FingerEstimator::overstretched(std::size_t finger) const noexcept {
  constexpr double kStraight = 0.02;
  const FingerMemory& memory = memory_[finger];
  if (problems_[finger].markers.empty() || memory.catching_up) return false;
  return side_sign() * memory.q_rad(kMiddleFlexion) < kStraight;
}

/// Looks at one finger per frame: the thumb, whose joints turn about other axes, is left out.
void FingerEstimator::unfold() noexcept {
  for (std::size_t i = 0; i < kFingers; ++i) {
    const std::size_t finger = unfold_next_;
    unfold_next_ = (unfold_next_ + 1) % kFingers;
    if (finger == static_cast<std::size_t>(Finger::kThumb) || !overstretched(finger)) continue;
    unfold(finger);
    return;
  }
}

/// Solves once more from a bent posture with about the same tip. There is no way back but through smaller bends: no
/// chatter.
void FingerEstimator::unfold(std::size_t finger) noexcept {
  constexpr double kBent = 0.1;
  FingerProblem problem = problems_[finger];
  problem.temporal_m_rad.setZero();  // the way there does not count
  problem.start_rad = memory_[finger].q_rad + side_sign() * angles(0, 0, -.35, 0, 0, .7, 0, 0, .45);
  problem.start_rad = problem.start_rad.cwiseMax(problem.lower_rad).cwiseMin(problem.upper_rad);
  const FingerSolution bent = solve_own(problem, std::min(config_.max_iterations, kTrialIterations), config_.tolerance);
  unfold_iterations_ = bent.iterations;
  const bool solved = bent.status == SolveStatus::kOptimal || bent.status == SolveStatus::kAtLimit;
  if (!solved || !(bent.cost_m2 < memory_[finger].cost_m2) || side_sign() * bent.q_rad(kMiddleFlexion) < kBent) return;
  memory_[finger].unfold_to_rad = bent.q_rad(kMiddleFlexion);
  memory_[finger].catching_up = true;
}

void FingerEstimator::rate(const HandPose& hand_pose, HandState& state) const noexcept {
  std::array<bool, kFingers> carries{};
  for (std::size_t f = 0; f < kFingers; ++f) {
    carries[f] = carried_[f] > 0;
    state.confidence[f] = finger_confidence(
        {carried_[f], state.visible_markers[f], memory_[f].unseen, memory_[f].residual_m, state.quality[f]},
        config_.confidence);
  }
  state.hand_confidence =
      hand_confidence(hand_pose.valid, hand_pose.fit_error_m, state.confidence, carries, config_.confidence);
}

void FingerEstimator::hold(std::size_t finger, Duration dt, HandState& state) noexcept {
  FingerMemory& memory = memory_[finger];
  iterations_[finger] = 0;
  memory.seen = 0;
  memory.unfold_to_rad.reset();
  memory.unseen += std::min(dt, kLongest - memory.unseen);
  const bool lost = memory.unseen > config_.hold;
  if (lost) memory.q_rad *= std::exp(-to_seconds(dt) / to_seconds(config_.decay));
  memory.q_rad = memory.q_rad.cwiseMax(config_.lower_rad[finger]).cwiseMin(config_.upper_rad[finger]);
  state.q_rad.segment<9>(static_cast<Index>(kFingerOffset[finger])) = memory.q_rad;
  const auto id = static_cast<Finger>(finger);
  memory.chain = model_.chain(id, memory.q_rad);
  state.p_M[finger] = {model_.point(id, 0, memory.chain), model_.point(id, 1, memory.chain)};
  state.distal_M[finger] = model_.distal(id, memory.chain);
  state.residual_m[finger] = memory.residual_m;
  state.quality[finger] = !memory.known ? FingerQuality::kNone : lost ? FingerQuality::kLost : FingerQuality::kHeld;
}

}  // namespace embody::hand
