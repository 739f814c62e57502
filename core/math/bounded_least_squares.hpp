#pragma once
// Nonlinear least squares inside a box: min ||r(x)||^2 subject to lower <= x <= upper, for a handful of variables.
// A projected Newton method with Levenberg-Marquardt damping (Bertsekas 1982; Nocedal & Wright, Numerical Optimization,
// ch. 10 and 16.7): variables that press against a bound are frozen, the others take a damped Newton step that is
// projected onto the box. No heap, no exceptions, bounded work, never outside of the box, never uphill.
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace embody::math {

/// Second-order model of a residual function at one point. Sizes are fixed (N, M) or bounded (Eigen::Dynamic with
/// MaxN, MaxM).
template <int N, int M, int MaxN = N, int MaxM = M>
struct LeastSquaresModel {
  using Variables = Eigen::Matrix<double, N, 1, 0, MaxN, 1>;
  using Square = Eigen::Matrix<double, N, N, 0, MaxN, MaxN>;

  Eigen::Matrix<double, M, 1, 0, MaxM, 1> r;     ///< residuals
  Eigen::Matrix<double, M, N, 0, MaxM, MaxN> J;  ///< their Jacobian dr/dx
  /// sum_k r_k * (second derivative of r_k). Zero on entry; leave it so for Gauss-Newton, fill it for Newton's
  /// quadratic convergence where residuals stay large.
  Square curvature;
};

struct LeastSquaresOptions {
  int max_iterations{50};           ///< each evaluates r and J at most once
  double gradient_tolerance{1e-9};  ///< on LeastSquaresResult::optimality
};

enum class LeastSquaresStatus {
  kConverged,  ///< the optimality is within the tolerance
  kStalled,    ///< no representable step decreases the cost; optimal within rounding
  kCapped,     ///< iteration cap reached; best point so far
  kInvalid,    ///< cost or derivatives are not finite at x (the start, unless they broke on the way)
};

template <class Variables>
struct LeastSquaresResult {
  Variables x;
  LeastSquaresStatus status{LeastSquaresStatus::kInvalid};
  double cost{0.0};        ///< ||r(x)||^2
  double optimality{0.0};  ///< first-order optimality in the box: max |project(x - J^T r) - x|
  int iterations{0};

  [[nodiscard]] bool converged() const noexcept {
    return status == LeastSquaresStatus::kConverged || status == LeastSquaresStatus::kStalled;
  }
};

/// max |project(x - g) - x|: zero exactly where the first-order conditions of the box-constrained minimum hold.
template <class Variables>
[[nodiscard]] double projected_gradient(const Variables& x, const Variables& g, const Variables& lower,
                                        const Variables& upper) noexcept {
  return ((x - g).cwiseMax(lower).cwiseMin(upper) - x).cwiseAbs().maxCoeff();
}

namespace detail {

/// Minimises g^T s + s^T A s / 2 over the box approximately: variables that press against a bound stay, those whose
/// step would cross one end there, and the others solve A s = -g exactly. Returns false when A is not positive
/// definite.
template <class Square, class Variables>
[[nodiscard]] bool box_newton_step(const Square& A, const Variables& g, const Variables& x, const Variables& lower,
                                   const Variables& upper, Variables& x_new) noexcept {
  const Eigen::Index n = x.size();
  auto fixed =
      ((x.array() <= lower.array() && g.array() > 0.0) || (x.array() >= upper.array() && g.array() < 0.0)).eval();
  Variables step = Variables::Zero(n);  // of the fixed variables
  x_new = x;
  for (Eigen::Index pass = 0; pass <= n; ++pass) {
    Square reduced = A;
    Variables b = -g - A.lazyProduct(step);
    for (Eigen::Index i = 0; i < n; ++i) {
      if (!fixed(i)) continue;
      reduced.row(i).setZero();
      reduced.col(i).setZero();
      reduced(i, i) = 1.0;
      b(i) = step(i);
    }
    const Eigen::LLT<Square> factor(reduced);
    if (factor.info() != Eigen::Success) return false;
    const Variables s = factor.solve(b);
    bool inside = true;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (fixed(i)) continue;
      x_new(i) = std::clamp(x(i) + s(i), lower(i), upper(i));
      if (x(i) + s(i) == x_new(i)) continue;
      fixed(i) = true;
      step(i) = x_new(i) - x(i);
      inside = false;
    }
    if (inside) return true;
  }
  return true;  // not reached: every pass fixes a variable or returns
}

}  // namespace detail

/// Second-order model of half a cost at one point, as the minimiser uses it.
template <int N, int MaxN = N>
struct NewtonModel {
  using Variables = Eigen::Matrix<double, N, 1, 0, MaxN, 1>;
  using Square = Eigen::Matrix<double, N, N, 0, MaxN, MaxN>;

  double cost{0.0};     ///< not halved: ||r||^2
  Variables gradient;   ///< of half the cost: J^T r
  Square gauss_newton;  ///< J^T J
  Square curvature;     ///< what the Hessian of half the cost has beyond gauss_newton; zero: Gauss-Newton
};

/// Minimises a cost in the box from the warm start `x`, which may lie outside (it is projected first).
/// `evaluate(x, model)` fills all of the model and must be noexcept. The result is a local minimum of the basin of the
/// start; its cost never exceeds the start's.
/// @pre lower <= upper, all finite; gauss_newton is positive semidefinite.
template <int N, int MaxN = N, class Evaluate>
[[nodiscard]] LeastSquaresResult<typename NewtonModel<N, MaxN>::Variables> minimize_in_box(
    const Evaluate& evaluate, const typename NewtonModel<N, MaxN>::Variables& start,
    const typename NewtonModel<N, MaxN>::Variables& lower, const typename NewtonModel<N, MaxN>::Variables& upper,
    const LeastSquaresOptions& options = {}) noexcept {
  using Model = NewtonModel<N, MaxN>;
  using Variables = typename Model::Variables;
  using Square = typename Model::Square;
  constexpr double kFirstDamping = 1e-3;  // relative to the diagonal of J^T J
  constexpr double kLeastDamping = 1e-7;  // below: a pure Newton step
  constexpr double kMostDamping = 1e12;

  Model model;
  Model trial;
  LeastSquaresResult<Variables> result;
  result.x = start.cwiseMax(lower).cwiseMin(upper);
  evaluate(result.x, model);
  result.cost = model.cost;
  if (!std::isfinite(result.cost)) return result;

  Square hessian = model.gauss_newton + model.curvature;
  double damping = 0.0;
  const auto raise_damping = [&]() noexcept { damping = damping > 0.0 ? 10.0 * damping : kFirstDamping; };
  for (;; ++result.iterations) {
    const Variables& g = model.gradient;
    result.optimality = projected_gradient(result.x, g, lower, upper);
    result.status = LeastSquaresStatus::kInvalid;
    if (!std::isfinite(result.optimality)) return result;
    result.status = LeastSquaresStatus::kConverged;
    if (result.optimality <= options.gradient_tolerance) return result;
    result.status = LeastSquaresStatus::kCapped;
    if (result.iterations >= options.max_iterations) return result;

    Variables x_trial = result.x;
    const auto solve_damped = [&]() noexcept {
      Square A = hessian;
      const double floor = 1e-12 * (1e-12 + model.gauss_newton.diagonal().maxCoeff());
      A.diagonal().array() += damping * (model.gauss_newton.diagonal().array() + floor);
      return detail::box_newton_step(A, g, result.x, lower, upper, x_trial);
    };
    bool solved = solve_damped();
    if (!solved) {  // indefinite curvature: Gauss-Newton
      hessian = model.gauss_newton;
      solved = solve_damped();
    }
    while (!solved && damping <= kMostDamping) {
      raise_damping();
      solved = solve_damped();
    }
    const Variables step = x_trial - result.x;
    const double predicted = -2.0 * g.dot(step) - step.dot(hessian.lazyProduct(step).eval());
    evaluate(x_trial, trial);
    if (!(trial.cost < result.cost)) {
      raise_damping();
      const bool below_rounding = step.cwiseAbs().maxCoeff() <= 1e-14 * (1.0 + result.x.cwiseAbs().maxCoeff()) ||
                                  std::abs(predicted) <= 4.0 * std::numeric_limits<double>::epsilon() * result.cost;
      if (!below_rounding && damping <= kMostDamping) continue;
      result.status = LeastSquaresStatus::kStalled;
      return result;
    }
    const double gain = (result.cost - trial.cost) / predicted;
    if (predicted <= 0.0 || gain < 0.25) {
      raise_damping();
    } else if (gain > 0.75) {
      damping = damping > kLeastDamping ? 0.1 * damping : 0.0;
    }
    result.x = x_trial;
    result.cost = trial.cost;
    std::swap(model, trial);
    hessian = model.gauss_newton + model.curvature;
  }
}

/// Minimises ||r(x)||^2 in the box: minimize_in_box() for residuals that are given one by one. For bounded sizes
/// `evaluate(x, model)` also sizes r and J. Cost and guarantees are those of minimize_in_box().
template <int N, int M, int MaxN = N, int MaxM = M, class Evaluate>
[[nodiscard]] LeastSquaresResult<typename LeastSquaresModel<N, M, MaxN, MaxM>::Variables> solve_bounded_least_squares(
    const Evaluate& evaluate, const typename LeastSquaresModel<N, M, MaxN, MaxM>::Variables& start,
    const typename LeastSquaresModel<N, M, MaxN, MaxM>::Variables& lower,
    const typename LeastSquaresModel<N, M, MaxN, MaxM>::Variables& upper,
    const LeastSquaresOptions& options = {}) noexcept {
  using Variables = typename LeastSquaresModel<N, M, MaxN, MaxM>::Variables;
  using Square = typename LeastSquaresModel<N, M, MaxN, MaxM>::Square;
  LeastSquaresModel<N, M, MaxN, MaxM> at;
  const auto normal_equations = [&](const Variables& x, NewtonModel<N, MaxN>& model) noexcept {
    at.curvature = Square::Zero(x.size(), x.size());
    evaluate(x, at);
    model.cost = at.r.squaredNorm();
    model.gradient = at.J.transpose().lazyProduct(at.r);
    model.gauss_newton = at.J.transpose().lazyProduct(at.J);
    model.curvature = at.curvature;
  };
  return minimize_in_box<N, MaxN>(normal_equations, start, lower, upper, options);
}

}  // namespace embody::math
