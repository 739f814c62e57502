#include "core/embodiment/hand_problem.hpp"

#include <algorithm>
#include <cmath>

#include "core/embodiment/segments.hpp"

namespace embody {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using robot::kNoIndex;

}  // namespace

HandProblem::HandProblem(const Chains& chains, const HandGoal& goal, const HandWeights& weights,
                         FingerSet fingers) noexcept
    : chains_(chains), goal_(goal), weights_(weights), fingers_(fingers) {
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!fingers_[f] || !chains_[f]) continue;
    for (const std::size_t motor : chains_[f]->motors()) {
      if (std::find(motors_.begin(), motors_.end(), motor) != motors_.end()) continue;
      variable_[motor] = static_cast<Index>(motors_.size());
      motors_.push_back(motor);
    }
  }
}

void HandProblem::update(const Variables& x, Postures& postures) const noexcept {
  std::array<double, kMaxHandJoints> r{};
  for (std::size_t i = 0; i < motors_.size(); ++i) r[motors_[i]] = x(static_cast<Index>(i));
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (fingers_[f] && chains_[f]) chains_[f]->update(r, piece_, postures[f]);
  }
}

HandProblem::Pair HandProblem::pair(std::size_t a, std::size_t b, const Postures& postures) const noexcept {
  const RobotFinger &first = *chains_[a], &second = *chains_[b];
  const NearestPoints near =
      nearest_points(first.position(first.pad_from(), postures[a]), first.position(first.pad_to(), postures[a]),
                     second.position(second.pad_from(), postures[b]), second.position(second.pad_to(), postures[b]));
  const Vector3d apart = near.on_b - near.on_a;
  const double distance_m = apart.norm();
  const Vector3d normal = distance_m > 1e-9 ? Vector3d(apart / distance_m) : Vector3d::UnitZ();
  return {a, b, distance_m - first.pad_radius_m() - second.pad_radius_m(), near.on_a, near.on_b, normal};
}

/// visit(pair, error in m, weight) for every pair of finger tips that costs something.
template <class Visit>
void HandProblem::visit_gaps(const Postures& postures, const Visit& visit) const noexcept {
  for (std::size_t a = 0; a < kFingers; ++a) {
    for (std::size_t b = a + 1; b < kFingers; ++b) {
      if (!fingers_[a] || !fingers_[b] || !chains_[a] || !chains_[b]) continue;
      if (!chains_[a]->has_pad() || !chains_[b]->has_pad()) continue;
      const bool pinched = a == 0 && goal_.pinch_weight[b] > 0.0;
      if (!pinched && !(weights_.collision_m > 0.0)) continue;
      const Pair gap = pair(a, b, postures);
      if (pinched) {
        visit(gap, gap.gap_m - goal_.pinch_gap_m[b], goal_.pinch_weight[b]);
      } else if (gap.gap_m < weights_.collision_m) {
        visit(gap, gap.gap_m - weights_.collision_m, weights_.collision_weight);
      }
    }
  }
}

double HandProblem::cost(const Variables& x) const noexcept {
  Postures postures;
  update(x, postures);
  double sum = 0.0;
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!fingers_[f] || !chains_[f]) continue;
    const RobotFinger& chain = *chains_[f];
    sum += (chain.position(chain.tip(), postures[f]) - goal_.points_P[f][0]).squaredNorm();
    sum += (chain.position(chain.middle(), postures[f]) - goal_.points_P[f][1]).squaredNorm();
    if (!(weights_.orientation_m > 0.0) || !chain.has_pad()) continue;
    const Vector3d along = chain.position(chain.pad_to(), postures[f]) - chain.position(chain.pad_from(), postures[f]);
    sum += weights_.orientation_m * weights_.orientation_m * (along.normalized() - goal_.directions_P[f]).squaredNorm();
  }
  visit_gaps(postures, [&](const Pair&, double error, double weight) { sum += weight * weight * error * error; });
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    const double stay = goal_.stay_m_rad[motors_[i]] * (x(static_cast<Index>(i)) - goal_.last_rad[motors_[i]]);
    sum += stay * stay;
  }
  return sum;
}

/// Adds weight^2 |error|^2 / 2 of a vector that moves with `joint`: a point at p_P, or a direction (whose error is
/// `error`, and which is `p_P` itself). The second derivative of the vector v by joints i <= j is w_i x (w_j x v),
/// v from the centre of j.
void HandProblem::add_vector(std::size_t finger, std::size_t joint, const Vector3d& p_P, bool direction,
                             const Vector3d& error, double weight, const RobotFinger::Posture& posture,
                             Model& model) const noexcept {
  const double w2 = weight * weight;
  model.cost += w2 * error.squaredNorm();
  if (joint == kNoIndex) return;
  const RobotFinger& chain = *chains_[finger];
  std::array<Vector3d, kMaxChainJoints> slopes;
  for (std::size_t j = 0; j <= joint; ++j) {
    slopes[j] = direction ? (chain.turns(j) ? Vector3d(posture.axes_P[j].cross(p_P)) : Vector3d::Zero().eval())
                          : chain.motion(j, p_P, posture);
  }
  for (std::size_t j = 0; j <= joint; ++j) {
    const Index b = variable_[chain.coupling(j).motor];
    model.gradient(b) += w2 * slopes[j].dot(error);
    for (std::size_t i = 0; i <= j; ++i) {
      const Index a = variable_[chain.coupling(i).motor];
      const double gauss_newton = w2 * slopes[i].dot(slopes[j]);
      const double curvature = chain.turns(i) ? w2 * posture.axes_P[i].cross(slopes[j]).dot(error) : 0.0;
      model.gauss_newton(a, b) += gauss_newton;
      model.curvature(a, b) += curvature;
      if (i == j) continue;
      model.gauss_newton(b, a) += gauss_newton;
      model.curvature(b, a) += curvature;
    }
  }
}

/// Adds weight^2 error^2 / 2 of a gap. The nearest points may be taken as fixed to their fingers: where they slide
/// along the axes, the distance does not change to first order.
void HandProblem::add_gap(const Pair& pair, double error, double weight, const Postures& postures,
                          Model& model) const noexcept {
  Variables slope = Variables::Zero(size());
  const auto add_finger = [&](std::size_t finger, const Vector3d& p_P, const Vector3d& along) {
    const RobotFinger& chain = *chains_[finger];
    if (chain.pad_to().joint == kNoIndex) return;
    for (std::size_t j = 0; j <= chain.pad_to().joint; ++j) {
      slope(variable_[chain.coupling(j).motor]) += along.dot(chain.motion(j, p_P, postures[finger]));
    }
  };
  add_finger(pair.a, pair.p_a, -pair.normal);
  add_finger(pair.b, pair.p_b, pair.normal);
  const double w2 = weight * weight;
  model.cost += w2 * error * error;
  model.gradient += w2 * error * slope;
  model.gauss_newton.noalias() += w2 * slope.lazyProduct(slope.transpose());
}

void HandProblem::evaluate(const Variables& x, Model& model) const noexcept {
  Postures postures;
  update(x, postures);
  const Index n = size();
  model.cost = 0.0;
  model.gradient.setZero(n);
  model.gauss_newton.setZero(n, n);
  model.curvature.setZero(n, n);
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!fingers_[f] || !chains_[f]) continue;
    const RobotFinger& chain = *chains_[f];
    const RobotFinger::Posture& posture = postures[f];
    for (const auto& [point, goal] :
         {std::pair{&chain.tip(), &goal_.points_P[f][0]}, std::pair{&chain.middle(), &goal_.points_P[f][1]}}) {
      const Vector3d p_P = chain.position(*point, posture);
      add_vector(f, point->joint, p_P, false, p_P - *goal, 1.0, posture, model);
    }
    if (!(weights_.orientation_m > 0.0) || !chain.has_pad()) continue;
    const Vector3d d_P =
        (chain.position(chain.pad_to(), posture) - chain.position(chain.pad_from(), posture)).normalized();
    add_vector(f, chain.pad_to().joint, d_P, true, d_P - goal_.directions_P[f], weights_.orientation_m, posture, model);
  }
  visit_gaps(postures,
             [&](const Pair& pair, double error, double weight) { add_gap(pair, error, weight, postures, model); });
  for (Index i = 0; i < n; ++i) {
    const std::size_t motor = motors_[static_cast<std::size_t>(i)];
    const double stay2 = goal_.stay_m_rad[motor] * goal_.stay_m_rad[motor];
    const double change = x(i) - goal_.last_rad[motor];
    model.cost += stay2 * change * change;
    model.gradient(i) += stay2 * change;
    model.gauss_newton(i, i) += stay2;
  }
}

}  // namespace embody
