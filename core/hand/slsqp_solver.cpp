// The reference solver: NLopt's SLSQP. The only file that knows NLopt.
#include <cmath>
#include <exception>
#include <nlopt.hpp>
#include <vector>

#include "core/hand/finger_problem.hpp"
#include "core/math/bounded_least_squares.hpp"

namespace embody::hand {
namespace {

double objective(const std::vector<double>& x, std::vector<double>& gradient, void* data) {
  const auto& problem = *static_cast<const FingerProblem*>(data);
  const Vector9 q = Eigen::Map<const Vector9>(x.data());
  Vector9 g;
  const double cost = problem.cost(q, g);
  if (!gradient.empty()) Eigen::Map<Vector9>(gradient.data()) = g;
  return cost;
}

}  // namespace

FingerSolution solve_slsqp(const FingerProblem& problem, int max_evaluations, double ftol) {
  const auto values = [](const Vector9& v) { return std::vector<double>(v.data(), v.data() + v.size()); };
  FingerSolution solution;
  solution.q_rad = problem.start_rad.cwiseMax(problem.lower_rad).cwiseMin(problem.upper_rad);
  if (!std::isfinite(problem.cost(solution.q_rad))) return solution;

  nlopt::opt slsqp(nlopt::LD_SLSQP, 9);
  FingerProblem copy = problem;
  slsqp.set_min_objective(&objective, &copy);
  slsqp.set_lower_bounds(values(problem.lower_rad));
  slsqp.set_upper_bounds(values(problem.upper_rad));
  slsqp.set_ftol_rel(ftol);
  slsqp.set_xtol_rel(ftol);
  slsqp.set_maxeval(max_evaluations);
  std::vector<double> x = values(solution.q_rad);
  double cost = 0.0;
  nlopt::result result = nlopt::SUCCESS;
  try {
    result = slsqp.optimize(x, cost);
  } catch (const nlopt::roundoff_limited&) {
    result = nlopt::ROUNDOFF_LIMITED;  // as near as numbers allow
  } catch (const std::exception&) {
    return solution;
  }
  solution.q_rad = Eigen::Map<const Vector9>(x.data());
  Vector9 gradient;
  solution.cost_m2 = problem.cost(solution.q_rad, gradient);
  solution.optimality =
      math::projected_gradient(solution.q_rad, Vector9(0.5 * gradient), problem.lower_rad, problem.upper_rad);
  solution.iterations = slsqp.get_numevals();
  solution.status = SolveStatus::kOptimal;
  if (result == nlopt::MAXEVAL_REACHED) {
    solution.status = SolveStatus::kCapped;
  } else if (pressed_against_bound(problem, solution.q_rad)) {
    solution.status = SolveStatus::kAtLimit;
  }
  return solution;
}

}  // namespace embody::hand
