#include "core/hand/finger_problem.hpp"

#include "core/math/bounded_least_squares.hpp"

namespace embody::hand {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Model = math::NewtonModel<9>;

constexpr Index kPipFlexion = 5, kDipFlexion = 8;

/// R of the paper: each angle on its own.
void add_paper_penalty(const FingerProblem& problem, const Vector9& q, Model& at) noexcept {
  for (Index i = 0; i < 9; ++i) {
    const double w = q(i) >= 0.0 ? problem.weight_plus(i) : problem.weight_minus(i);
    at.cost += w * w * q(i) * q(i);
    at.gradient(i) += w * w * q(i);
    at.gauss_newton(i, i) += w * w;
  }
}

/// R of the published implementation: the square of one weighted sum per sign.
void add_published_penalty(const FingerProblem& problem, const Vector9& q, Model& at) noexcept {
  const Vector9 plus = (q.array() > 0.0).select(problem.weight_plus, 0.0);
  const Vector9 minus = (q.array() < 0.0).select(problem.weight_minus, 0.0);
  for (const Vector9& w : {plus, minus}) {
    const double sum = w.dot(q);
    at.cost += sum * sum;
    at.gradient += sum * w;
    at.gauss_newton += w * w.transpose();
  }
}

void add_prior(const FingerProblem& problem, const Vector9& q, Model& at) noexcept {
  const double a = problem.coupling_m_rad, r = problem.coupling_ratio;
  const double bend = a * (q(kDipFlexion) - r * q(kPipFlexion));
  at.cost += bend * bend;
  at.gradient(kDipFlexion) += a * bend;
  at.gradient(kPipFlexion) -= a * r * bend;
  at.gauss_newton(kDipFlexion, kDipFlexion) += a * a;
  at.gauss_newton(kPipFlexion, kPipFlexion) += a * a * r * r;
  at.gauss_newton(kDipFlexion, kPipFlexion) -= a * a * r;
  at.gauss_newton(kPipFlexion, kDipFlexion) -= a * a * r;
  const Vector9 t2 = problem.temporal_m_rad.cwiseAbs2();
  const Vector9 change = q - problem.q_previous_rad;
  at.cost += t2.dot(change.cwiseAbs2());
  at.gradient += t2.cwiseProduct(change);
  at.gauss_newton.diagonal() += t2;
}

void evaluate(const FingerProblem& problem, const Vector9& q, Model& at) noexcept {
  at.cost = 0.0;
  at.gradient.setZero();
  at.gauss_newton.setZero();
  at.curvature.setZero();
  const HandModel& model = *problem.model;
  const FingerChain chain = model.chain(problem.finger, q);
  for (const FingerMeasurement& marker : problem.markers) {
    const Vector3d error = model.point(problem.finger, marker.point, chain) - marker.p_M;
    const PointJacobian J = model.jacobian(problem.finger, marker.point, chain);
    const auto n = 3 * static_cast<Index>(model.joints_moving(problem.finger, marker.point));
    at.cost += marker.weight * error.squaredNorm();
    at.gradient += marker.weight * J.transpose().lazyProduct(error);
    for (Index i = 0; i < n; ++i) {
      for (Index k = 0; k <= i; ++k) {
        const double s = marker.weight * J.col(i).dot(J.col(k));
        at.gauss_newton(i, k) += s;
        if (k != i) at.gauss_newton(k, i) += s;
      }
    }
    model.add_curvature(problem.finger, marker.point, chain, marker.weight * error, at.curvature);
  }
  if (problem.objective == FingerObjective::kPaper) {
    add_paper_penalty(problem, q, at);
  } else {
    add_published_penalty(problem, q, at);
  }
  add_prior(problem, q, at);
}

}  // namespace

double FingerProblem::cost(const Vector9& q_rad) const noexcept {
  Model at;
  evaluate(*this, q_rad, at);
  return at.cost;
}

double FingerProblem::cost(const Vector9& q_rad, Vector9& gradient) const noexcept {
  Model at;
  evaluate(*this, q_rad, at);
  gradient = 2.0 * at.gradient;
  return at.cost;
}

bool pressed_against_bound(const FingerProblem& problem, const Vector9& q_rad) noexcept {
  constexpr double kTouch = 1e-9;
  return ((problem.lower_rad.array() < problem.upper_rad.array()) &&
          (q_rad.array() <= problem.lower_rad.array() + kTouch || q_rad.array() >= problem.upper_rad.array() - kTouch))
      .any();
}

FingerSolution solve_own(const FingerProblem& problem, int max_iterations, double tolerance) noexcept {
  const auto at = [&problem](const Vector9& q, Model& model) noexcept { evaluate(problem, q, model); };
  const auto found = math::minimize_in_box<9>(at, problem.start_rad, problem.lower_rad, problem.upper_rad,
                                              {max_iterations, tolerance});
  FingerSolution solution{found.x, SolveStatus::kOptimal, found.cost, found.optimality, found.iterations};
  if (found.status == math::LeastSquaresStatus::kInvalid) {
    solution.q_rad = problem.start_rad;
    solution.status = SolveStatus::kInvalid;
  } else if (!found.converged()) {
    solution.status = SolveStatus::kCapped;
  } else if (pressed_against_bound(problem, found.x)) {
    solution.status = SolveStatus::kAtLimit;
  }
  return solution;
}

}  // namespace embody::hand
